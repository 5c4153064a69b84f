#include "daemon/ctl/live/check/robot_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace crepes::robot_check_test {
namespace {

using Sensor = client::Status::Sensor;

/// A robot with one neighbor, watched for three seconds, with nothing wrong.
RobotObservation healthy() {
  client::Status status;
  status.self = 1;
  status.sensors = {{"cam0", 200.0, true, "", {}, {{"frames", 1000}}},
                    {"cam0 spots",
                     200.0,
                     true,
                     "",
                     {},
                     {{"background", 4},
                      {"threshold", 30},
                      {"brightest", 255},
                      {"faintest", 200},
                      {"spots", 1},
                      {"delay_p99_us", 2000}}},
                    {"imu", 100.0, true, "", {}, {{"force_mmps2", 9815}, {"turn_mradps", 4}}},
                    {"uwb", 50.0, true, "", {}, {}},
                    {"mesh", 0.0, true, "", {}, {}}};
  client::Status::Neighbor neighbor;
  neighbor.peer = 2;
  neighbor.name = "r2";
  neighbor.state = "direct";
  neighbor.reports = client::Status::Reports{.received = 100, .lost = 0, .age_s = 0.02};
  neighbor.measurements = {{"bearing", {{"fused", 100}}},
                           {"peer_bearing", {{"fused", 100}}},
                           {"range", {{"fused", 100}}}};
  status.neighbors = {neighbor};
  status.clocks = {{2, 3.0, 12.0, 1e-4}};
  status.mesh = client::Status::Mesh{
      .sealed = true, .signs = true, .warning = "", .airtime = 0.03, .airtime_of_all = 0.05};
  RobotObservation seen;
  seen.before = status;
  seen.after = status;
  for (auto& [kind, verdicts] : seen.after.neighbors[0].measurements) verdicts["fused"] += 60;
  seen.duration_s = 3.0;
  return seen;
}

Sensor& sensor(RobotObservation& seen, const std::string& name) {
  return *std::ranges::find(seen.after.sensors, name, &Sensor::name);
}

/// What is not good, as "about verdict: text".
std::string complaints(const RobotObservation& seen) {
  std::string text;
  for (const CheckFinding& finding : check_robot(seen)) {
    if (finding.verdict == CheckVerdict::kGood) continue;
    EXPECT_NE(finding.advice, "") << finding.text;
    text += (text.empty() ? "" : "\n") + finding.about + " " +
            std::string(name_of(finding.verdict)) + ": " + finding.text;
  }
  return text;
}

TEST(RobotCheck, FindsNothingWrongWithAHealthyRobot) {
  const RobotObservation seen = healthy();

  EXPECT_EQ(complaints(seen), "");
  std::vector<std::string> sections;
  for (const CheckFinding& finding : check_robot(seen))
    if (sections.empty() || sections.back() != finding.about) sections.push_back(finding.about);
  EXPECT_EQ(sections, (std::vector<std::string>{"sensors", "rates", "clocks", "exposure", "board",
                                                "mesh", "calibration"}));
}

TEST(RobotCheck, RepeatsWhatASensorSaysOfItself) {
  RobotObservation seen = healthy();
  sensor(seen, "uwb").ok = false;
  sensor(seen, "uwb").message = "no such file";
  sensor(seen, "uwb").rate_hz = 0.0;

  EXPECT_EQ(complaints(seen), "sensors fault: uwb: no such file\nrates fault: uwb: silent");
}

TEST(RobotCheck, NamesAnAddressThatIsNotServedOnce) {
  RobotObservation seen = healthy();
  seen.after.sensors.push_back({"subscription", 0.0, false, "10.0.0.1:47475: in use", {}, {}});

  EXPECT_EQ(complaints(seen), "sensors fault: subscription: 10.0.0.1:47475: in use");
}

TEST(RobotCheck, CountsOnlyFaultsThatGrow) {
  RobotObservation seen = healthy();
  seen.before.sensors[2].faults = {{"dropped", 7}};
  sensor(seen, "imu").faults = {{"dropped", 7}};
  EXPECT_EQ(complaints(seen), "");

  sensor(seen, "imu").faults = {{"dropped", 12}};

  EXPECT_EQ(complaints(seen), "sensors doubt: imu: in 3 s, dropped 5");
}

TEST(RobotCheck, ComparesRatesWithTheConfiguration) {
  RobotObservation seen = healthy();
  seen.config.emplace();
  seen.config->robot.id = RobotId{1};
  seen.config->imu.noise.update_rate = 200.0;

  EXPECT_EQ(complaints(seen), "rates doubt: imu: 100.0 of 200 Hz");
}

TEST(RobotCheck, NamesTheConfigurationOfAnotherRobotFirst) {
  RobotObservation seen = healthy();
  seen.config.emplace();
  seen.config->robot.id = RobotId{2};
  seen.config->imu.noise.update_rate = 200.0;

  EXPECT_EQ(complaints(seen),
            "configuration fault: --config is robot 2's, this daemon is robot 1\n"
            "rates doubt: imu: 100.0 of 200 Hz");
}

TEST(RobotCheck, NamesWhatTheDaemonDidNotTakeOver) {
  RobotObservation seen = healthy();
  seen.config_state = {.fault = "r1.yaml:20: uwb.noise: unknown key", .restart = "cameras"};

  EXPECT_EQ(complaints(seen),
            "configuration fault: the last reload was refused: r1.yaml:20: uwb.noise: unknown key\n"
            "configuration doubt: changed, but not in use yet: cameras");
  EXPECT_EQ(check_robot(seen)[1].advice, "systemctl restart crepesd");
}

TEST(RobotCheck, NoticesSpotsThatFallBehindTheirCamera) {
  RobotObservation seen = healthy();
  sensor(seen, "cam0 spots").rate_hz = 90.0;

  EXPECT_EQ(complaints(seen), "rates doubt: cam0 spots: 90.0 Hz, the camera has 200.0");
}

TEST(RobotCheck, FindsNothingGoodInACameraThatIsSilent) {
  RobotObservation seen = healthy();
  for (const char* name : {"cam0", "cam0 spots"}) sensor(seen, name).rate_hz = 0.0;

  EXPECT_EQ(complaints(seen), "rates fault: cam0: silent\nrates fault: cam0 spots: silent");
}

TEST(RobotCheck, ClaimsNothingAboutSpotsWhoseCountsAreUnknown) {
  RobotObservation seen = healthy();
  sensor(seen, "cam0 spots").counts.clear();

  EXPECT_EQ(complaints(seen),
            "rates doubt: cam0 spots: 200.0 Hz, time from picture to spots unknown\n"
            "exposure doubt: cam0 spots: background and lights unknown");
}

TEST(RobotCheck, NoticesAClockThatIsNotKnown) {
  RobotObservation seen = healthy();
  seen.after.clocks.clear();

  EXPECT_EQ(complaints(seen), "clocks fault: r2: clock offset unknown");
}

TEST(RobotCheck, DoesNotCallAClockPerfectWhoseErrorIsNotKnown) {
  RobotObservation seen = healthy();
  seen.after.clocks = {{2, 3.0, {}, {}}};

  EXPECT_EQ(complaints(seen), "clocks doubt: r2: known, but not how well");
}

TEST(RobotCheck, JudgesTheExposureByBackgroundAndLights) {
  const auto with = [](const std::string& name, std::uint64_t level) {
    RobotObservation seen = healthy();
    sensor(seen, "cam0 spots").counts[name] = level;
    return complaints(seen);
  };

  EXPECT_NE(with("background", 90).find("exposure doubt"), std::string::npos);
  EXPECT_NE(with("brightest", 120).find("exposure doubt"), std::string::npos);
  EXPECT_NE(with("faintest", 35).find("exposure doubt"), std::string::npos);
  EXPECT_NE(with("spots", 80).find("80 lights"), std::string::npos);
  EXPECT_NE(with("brightest", 0).find("no light in view"), std::string::npos);
}

TEST(RobotCheck, NoticesBoardsOfAnotherSwarm) {
  RobotObservation seen = healthy();
  seen.before.estimator["foreign_boards"] = 3;
  seen.after.estimator["foreign_boards"] = 3;
  EXPECT_EQ(complaints(seen), "");

  seen.after.estimator["foreign_boards"] = 5;
  EXPECT_EQ(complaints(seen), "board doubt: 2 lights blink nearly as a member, but are none");
}

TEST(RobotCheck, LetsTheOthersSeeOurBoard) {
  RobotObservation seen = healthy();
  seen.after.neighbors[0].measurements["peer_bearing"] =
      seen.before.neighbors[0].measurements["peer_bearing"];

  EXPECT_EQ(complaints(seen), "board doubt: our board is not seen by r2");
}

TEST(RobotCheck, JudgesTheMesh) {
  RobotObservation seen = healthy();
  seen.after.mesh->sealed = false;
  seen.after.mesh->airtime_of_all = 0.95;
  seen.after.neighbors[0].reports->loss = 0.4;
  seen.after.network = {{"refused_seal_broken", 5}};

  EXPECT_EQ(complaints(seen),
            "mesh doubt: not sealed: whoever is on the mesh can read and forge\n"
            "mesh fault: 95.0 % of the air by all that are heard\n"
            "mesh doubt: r2: 40 % lost\n"
            "mesh doubt: in 3 s, refused_seal_broken 5");
}

TEST(RobotCheck, NoticesARobotThatWasNeverHeard) {
  RobotObservation seen = healthy();
  seen.after.neighbors[0].reports.reset();
  seen.after.clocks.clear();

  EXPECT_EQ(complaints(seen),
            "board doubt: no neighbor is heard that could see our board\n"
            "mesh fault: r2: never heard");
}

TEST(RobotCheck, DoesNotBlameTheBoardForARobotThatIsSilent) {
  RobotObservation seen = healthy();
  seen.after.neighbors[0].reports->age_s = 14.0;
  seen.after.neighbors[0].measurements["peer_bearing"] =
      seen.before.neighbors[0].measurements["peer_bearing"];

  EXPECT_EQ(complaints(seen),
            "board doubt: no neighbor is heard that could see our board\n"
            "mesh fault: r2: silent for 14 s");
}

TEST(RobotCheck, SaysNothingOfMeasurementsThatNoEstimateWasThereFor) {
  RobotObservation seen = healthy();
  for (auto* status : {&seen.before, &seen.after}) {
    for (auto& [kind, verdicts] : status->neighbors[0].measurements)
      verdicts = {{"no_state", status == &seen.before ? 100U : 400U}};
  }

  for (const CheckFinding& finding : check_robot(seen))
    EXPECT_EQ(finding.text.find("contradict the estimate"), std::string::npos) << finding.text;
}

TEST(RobotCheck, HoldsGravityAndTheMeasurementsAgainstEachOther) {
  RobotObservation seen = healthy();
  sensor(seen, "imu").counts["force_mmps2"] = 9500;
  seen.after.neighbors[0].measurements["range"]["gated"] = 40;

  EXPECT_EQ(complaints(seen),
            "calibration doubt: gravity measures 9.50 m/s^2\n"
            "calibration doubt: ranges to r2: 40.0 % contradict the estimate");
}

TEST(RobotCheck, NamesACameraThatIsNotCalibratedOnce) {
  RobotObservation seen = healthy();
  sensor(seen, "cam0 spots").ok = false;
  sensor(seen, "cam0 spots").calibrated = false;
  sensor(seen, "cam0 spots").message = "not calibrated: no pose comes from this camera";

  EXPECT_EQ(complaints(seen),
            "calibration fault: cam0 spots: not calibrated: no pose comes from this camera");
}

TEST(RobotCheck, SaysInWordsWhereANeighborIs) {
  client::Pose message;
  message.name = "r2";
  message.position = {3.0, -1.0, -0.5};
  message.orientation = {std::cos(1.55), std::sin(1.55), 0.0, 0.0};
  message.up = client::Vector{0.0, 0.0, 1.0};

  EXPECT_EQ(places_text({{RobotId{2}, message}}),
            "  r2 is 3.20 m away, 18 deg to the right, 0.50 m below along our z, upside down\n");
}

}  // namespace
}  // namespace crepes::robot_check_test
