#include "daemon/ctl/score/evaluate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "daemon/ctl/replay/replay_output.hpp"
#include "daemon/ctl/score/pair_score.hpp"
#include "drivers/dataset/pose_file.hpp"
#include "tests/daemon/ctl/tiny_swarm.hpp"

namespace crepes::evaluate_test {
namespace {

using Eigen::Vector3d;
using namespace std::chrono_literals;

Timestamp at_ms(std::int64_t ms) { return Timestamp{std::chrono::milliseconds(ms)}; }

/// A pose `error_m` off along x and `error_rad` off about z of a truth that is the identity.
NeighborPose off_by(std::int64_t ms, double error_m, double error_rad) {
  NeighborPose pose;
  pose.neighbor = RobotId{2};
  pose.stamp = at_ms(ms);
  pose.published = pose.stamp + 3ms;
  pose.mode = PoseMode::kDirect;
  pose.T_B_N.pose = {{error_m, 0.0, 0.0}, so3_exp({0.0, 0.0, error_rad})};
  pose.T_B_N.covariance = 0.01 * Matrix6d::Identity();
  return pose;
}

std::optional<Pose> identity(Timestamp) { return Pose{}; }

TEST(Statistics, AreWhatAHandComputes) {
  const ErrorStatistics s = statistics_of({3.0, 1.0, 2.0, 4.0});

  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.max, 4.0);
  EXPECT_DOUBLE_EQ(median_of({5.0, 1.0, 2.0}), 2.0);
  EXPECT_TRUE(std::isnan(statistics_of({}).rmse));
}

TEST(PairScore, ScoresTheWindowOnly) {
  const std::vector<NeighborPose> poses{off_by(0, 9.0, 0.0), off_by(20, 0.3, 0.1),
                                        off_by(40, 0.4, 0.3), off_by(60, 9.0, 0.0)};

  const PairScore score = score_pair(poses, identity, at_ms(-10), {at_ms(20), at_ms(40)});

  EXPECT_EQ(score.rows, 2U);
  EXPECT_DOUBLE_EQ(statistics_of(score.position_errors_m).rmse, std::sqrt((0.09 + 0.16) / 2.0));
  EXPECT_NEAR(statistics_of(score.rotation_errors_rad).max, 0.3, 1e-12);
  EXPECT_NEAR(median_of(score.nees), ((9.0 + 1.0) + (16.0 + 9.0)) / 2.0, 1e-9);
  EXPECT_EQ(score.max_age, 3ms);
  EXPECT_EQ(score.first_row, Duration{10ms});
  EXPECT_EQ(score.modes[static_cast<std::size_t>(PoseMode::kDirect)], 2U);
  EXPECT_DOUBLE_EQ(score.availability, 1.0);
}

TEST(PairScore, CountsTheInstantsWithoutARow) {
  std::vector<NeighborPose> poses;
  for (const int ms : {100, 120, 180, 200}) poses.push_back(off_by(ms, 0.0, 0.0));

  // 0, 20 ... 200: eleven instants, four with a row.
  const PairScore score = score_pair(poses, identity, at_ms(0), {at_ms(0), at_ms(200)});

  EXPECT_DOUBLE_EQ(score.availability, 4.0 / 11.0);
}

TEST(PairScore, AJitterOfRowsCostsNoAvailability) {
  std::vector<NeighborPose> poses;
  for (const int ms : {5, 21, 44, 60, 88, 99}) poses.push_back(off_by(ms, 0.0, 0.0));

  const PairScore score = score_pair(poses, identity, at_ms(0), {at_ms(0), at_ms(110)});

  EXPECT_DOUBLE_EQ(score.availability, 1.0);
}

TEST(PairScore, MoreRowsThanInstantsAreNoMoreAvailable) {
  std::vector<NeighborPose> poses;
  for (int ms = 0; ms <= 100; ++ms) poses.push_back(off_by(ms, 0.0, 0.0));

  // A burst in the first 100 ms of 400 ms: at most one instant beyond it is served.
  const PairScore score = score_pair(poses, identity, at_ms(0), {at_ms(0), at_ms(400)});

  EXPECT_DOUBLE_EQ(score.availability, 6.0 / 21.0);
}

TEST(PairScore, GivenACovarianceThatIsNone) {
  NeighborPose pose = off_by(0, 0.1, 0.0);
  pose.T_B_N.covariance(2, 2) = -1.0;

  const PairScore score = score_pair(std::vector{pose}, identity, at_ms(0), {at_ms(0), at_ms(10)});

  EXPECT_EQ(score.bad_covariances, 1U);
  EXPECT_TRUE(std::isnan(median_of(score.nees)));
}

TEST(PairScore, CountsASpellOfErrorsThatTheCovarianceDeniesOnce) {
  std::vector<NeighborPose> poses;
  const auto add = [&poses](int from_ms, int to_ms, double error_m) {
    for (int ms = from_ms; ms < to_ms; ms += 20) poses.push_back(off_by(ms, error_m, 0.0));
  };
  add(0, 900, 1.1);      // ends before a second is over
  add(900, 2000, 0.9);   // nine sigma
  add(2000, 5000, 1.1);  // more than 10 sigma
  add(6000, 6800, 1.1);  // after a gap, and short
  add(6800, 7000, 0.0);
  add(7000, 8100, -1.1);

  const PairScore score = score_pair(poses, identity, at_ms(0), {at_ms(0), at_ms(9000)});

  EXPECT_EQ(score.divergences, 2U);
  EXPECT_DOUBLE_EQ(share_within(score.nees, kNees95), 10.0 / static_cast<double>(poses.size()));
}

TEST(PairScore, OfNothingIsUnavailable) {
  const PairScore score = score_pair({}, identity, at_ms(0), {at_ms(0), at_ms(1000)});

  EXPECT_EQ(score.rows, 0U);
  EXPECT_EQ(score.availability, 0.0);
  EXPECT_FALSE(score.first_row);
}

/// Poses every 20 ms; sigma is 0.1 m an axis, so 0.6 m is beyond 5 sigma and 0.59 m is not.
class GrossPoses {
 public:
  void add(int count, double error_m, PoseMode mode) {
    for (int i = 0; i < count; ++i, ms_ += 20) {
      poses_.push_back(off_by(ms_, error_m, 0.0));
      poses_.back().mode = mode;
    }
  }
  void pause(std::int64_t ms) { ms_ += ms; }
  void spoil_last_covariance() { poses_.back().T_B_N.covariance(2, 2) = -1.0; }
  [[nodiscard]] GrossErrorsByMode errors() const {
    return score_pair(poses_, identity, at_ms(0), {at_ms(0), at_ms(ms_)}).gross_errors;
  }

 private:
  std::int64_t ms_ = 0;
  std::vector<NeighborPose> poses_;
};

const GrossErrors& of(const GrossErrorsByMode& errors, PoseMode mode) {
  return errors.modes.at(static_cast<std::size_t>(mode));
}

TEST(GrossErrors, AreSharesAndLargestErrorsOfEachMode) {
  GrossPoses poses;
  poses.add(6, 0.59, PoseMode::kDirect);
  poses.add(2, 0.6, PoseMode::kDirect);
  poses.add(1, 0.1, PoseMode::kGraph);
  poses.add(1, -2.0, PoseMode::kPredicted);

  const GrossErrorsByMode errors = poses.errors();

  EXPECT_DOUBLE_EQ(errors.all.share(), 0.3);
  EXPECT_DOUBLE_EQ(errors.all.max_position_m, 2.0);
  EXPECT_DOUBLE_EQ(of(errors, PoseMode::kDirect).share(), 0.25);
  EXPECT_DOUBLE_EQ(of(errors, PoseMode::kDirect).max_position_m, 0.6);
  EXPECT_DOUBLE_EQ(of(errors, PoseMode::kGraph).share(), 0.0);
  EXPECT_DOUBLE_EQ(of(errors, PoseMode::kPredicted).share(), 1.0);
}

TEST(GrossErrors, RunOverModesUntilAPoseIsGood) {
  GrossPoses poses;
  poses.add(10, 1.0, PoseMode::kDirect);
  poses.add(20, 1.0, PoseMode::kPredicted);
  poses.add(1, 0.0, PoseMode::kPredicted);
  poses.add(25, 1.0, PoseMode::kPredicted);

  const GrossErrorsByMode errors = poses.errors();

  EXPECT_EQ(errors.all.longest_run, 600ms);
  EXPECT_EQ(of(errors, PoseMode::kDirect).longest_run, 200ms);
  EXPECT_EQ(of(errors, PoseMode::kPredicted).longest_run, 500ms);
  EXPECT_EQ(of(errors, PoseMode::kGraph).longest_run, 0ms);
}

TEST(GrossErrors, RunOverShortGapsOnly) {
  GrossPoses poses;
  poses.add(10, 1.0, PoseMode::kDirect);
  poses.pause(480);
  poses.add(10, 1.0, PoseMode::kDirect);
  poses.pause(500);
  poses.add(10, 1.0, PoseMode::kDirect);

  EXPECT_EQ(poses.errors().all.longest_run, 880ms);
}

TEST(GrossErrors, IncludeAPoseWithoutAValidCovariance) {
  GrossPoses poses;
  poses.add(1, 0.0, PoseMode::kDirect);
  poses.spoil_last_covariance();

  EXPECT_EQ(poses.errors().all.beyond, 1U);
  EXPECT_EQ(poses.errors().all.longest_run, 20ms);
}

TEST(GrossErrors, UseTheCovarianceOfThePositionAlone) {
  const std::vector<NeighborPose> turned{off_by(0, 0.5, 3.0)};

  const PairScore score = score_pair(turned, identity, at_ms(0), {at_ms(0), at_ms(0)});

  EXPECT_GT(score.nees.front(), 100.0);
  EXPECT_EQ(score.gross_errors.all.beyond, 0U);
}

TEST(GrossErrors, OfPairsArePooled) {
  GrossPoses far;
  far.add(5, 1.0, PoseMode::kDirect);
  GrossPoses near;
  near.add(15, 0.2, PoseMode::kDirect);
  GrossErrorsByMode both = far.errors();

  merge(both, near.errors());

  EXPECT_DOUBLE_EQ(both.all.share(), 0.25);
  EXPECT_EQ(both.all.longest_run, 100ms);
  EXPECT_DOUBLE_EQ(of(both, PoseMode::kDirect).max_position_m, 1.0);
  EXPECT_TRUE(std::isnan(of(both, PoseMode::kGraph).share()));
}

/// r2 stands 2 m ahead of r1, turned by a right angle, for the whole fifth of a second.
class Evaluate : public testing::Test {
 protected:
  void SetUp() override {
    swarm_.write("truth/r1.csv", "#\n0,0,0,0,1,0,0,0,0,0,0\n1,0,0,0,1,0,0,0,0,0,0\n");
    swarm_.write("truth/r2.csv",
                 "#\n0,2,0,0,0.70710678118654757,0,0,0.70710678118654757,0,0,0\n"
                 "1,2,0,0,0.70710678118654757,0,0,0.70710678118654757,0,0,0\n");
  }

  /// Poses of r2 as seen by r1, 0.1 m off, every 20 ms of the recording.
  void write_results(double error_m) {
    auto output = ReplayOutput::create(results(), {{RobotId{1}, "r1"}, {RobotId{2}, "r2"}}).value();
    for (int ms = 10'000; ms <= 10'200; ms += 20) {
      NeighborPose pose = off_by(ms, 2.0 + error_m, std::numbers::pi / 2);
      output.write(RobotId{1}, pose);
    }
    ASSERT_TRUE(output.finish({}));
  }

  [[nodiscard]] std::filesystem::path results() const { return swarm_.dir() / "out"; }

  [[nodiscard]] EvaluateOptions options() const {
    return {.results = results(),
            .swarm = swarm_.dir(),
            .against = {},
            .after_s = 0.1,
            .json = true,
            .on_progress = {}};
  }

  TinySwarm swarm_;
};

TEST_F(Evaluate, FindsTheErrorThatWasPutIn) {
  write_results(0.1);

  const auto json = nlohmann::json::parse(evaluate(options()).value());

  const auto& pair = json["pairs"][0];
  EXPECT_EQ(pair["observer"], "r1");
  EXPECT_EQ(pair["rows"], 6);
  EXPECT_EQ(pair["availability"], 1.0);
  EXPECT_NEAR(pair["position_m"]["rmse"].get<double>(), 0.1, 1e-12);
  EXPECT_NEAR(pair["rotation_deg"]["max"].get<double>(), 0.0, 1e-6);
  EXPECT_NEAR(pair["median_nees"].get<double>(), 1.0, 1e-9);
  EXPECT_NEAR(pair["max_age_s"].get<double>(), 0.003, 1e-12);
  EXPECT_EQ(json["pairs"][1]["rows"], 0);
  EXPECT_FALSE(json["pairs"][1].contains("max_age_s"));
  EXPECT_NEAR(json["overall"]["mean_availability"].get<double>(), 0.5, 1e-12);
  EXPECT_NEAR(json["overall"]["mean_position_rmse_m"].get<double>(), 0.1, 1e-12);
}

TEST_F(Evaluate, ReportsPosesBeyondFiveSigmaPerPairAndInAll) {
  write_results(0.7);
  EvaluateOptions asked = options();

  const auto json = nlohmann::json::parse(evaluate(asked).value());
  asked.json = false;
  const std::string table = evaluate(asked).value();

  for (const auto& of : {json["pairs"][0]["beyond_5_sigma"], json["overall"]["beyond_5_sigma"]}) {
    for (const char* mode : {"all", "direct"}) {
      EXPECT_EQ(of[mode]["poses"], 6);
      EXPECT_EQ(of[mode]["share"], 1.0);
      EXPECT_NEAR(of[mode]["longest_run_s"].get<double>(), 0.12, 1e-12);
      EXPECT_NEAR(of[mode]["max_position_m"].get<double>(), 0.7, 1e-12);
    }
    EXPECT_EQ(of["predicted"], nlohmann::json({{"poses", 0}}));
  }
  EXPECT_EQ(json["pairs"][1]["beyond_5_sigma"]["all"]["poses"], 0);
  EXPECT_NE(table.find("100.000   0.12  0.700   100.000   0.12  0.700        -      -      -"),
            std::string::npos)
      << table;
}

TEST_F(Evaluate, ComparesTwoResults) {
  write_results(0.1);
  std::filesystem::rename(results(), swarm_.dir() / "other");
  write_results(0.05);
  EvaluateOptions both = options();
  both.against = swarm_.dir() / "other";
  both.json = false;

  const std::string table = evaluate(both).value();

  EXPECT_NE(table.find("0.0500   0.1000  0.500"), std::string::npos) << table;
}

TEST_F(Evaluate, JudgesTheClocksThatTheReportHolds) {
  swarm_.write("swarm.yaml",
               "scenario: tiny\nduration_s: 10\nnetwork: {latency_ms: 1, jitter_ms: 0, loss: 0, "
               "seed: 1}\nrobots:\n"
               "- {id: 1, name: r1, dir: r1, clock: {offset_s: 10.0, skew_ppm: 0.0}}\n"
               "- {id: 2, name: r2, dir: r2, clock: {offset_s: 20.0, skew_ppm: 100.0}}\n");
  write_results(0.0);
  // r2 - r1 is 10 s plus 0.1 ms a second. The first sample comes before clocks are judged.
  swarm_.write("out/report.json", R"({"clocks":[
    {"observer":"r1","peer":"r2","t_s":12.0,"offset_s":77.0,"skew_ppm":0},
    {"observer":"r1","peer":"r2","t_s":14.0,"offset_s":10.0005,"skew_ppm":0},
    {"observer":"r1","peer":"r2","t_s":15.0,"offset_s":10.0007,"skew_ppm":0}]})");

  const auto json = nlohmann::json::parse(evaluate(options()).value());

  ASSERT_EQ(json["clocks"].size(), 1U);
  EXPECT_EQ(json["clocks"][0]["samples"], 2);
  EXPECT_NEAR(json["clocks"][0]["max_error_s"].get<double>(), 2e-4, 1e-9);
}

TEST_F(Evaluate, SaysWhatIsMissing) {
  const auto nothing = evaluate(options());
  ASSERT_FALSE(nothing);
  EXPECT_NE(nothing.error().message.find("out: no <observer>/<neighbor>.csv"), std::string::npos);

  write_results(0.1);
  std::filesystem::remove(swarm_.dir() / "truth/r2.csv");
  EXPECT_NE(evaluate(options()).error().message.find("truth/r2.csv: no such file"),
            std::string::npos);
}

TEST_F(Evaluate, SaysWhichDirectoryIsNotWhatItShouldBe) {
  write_results(0.1);
  const auto message = [](EvaluateOptions options) {
    const auto text = evaluate(options);
    return text ? *text : text.error().message;
  };
  EvaluateOptions swapped = options();
  std::swap(swapped.results, swapped.swarm);
  EvaluateOptions same = options();
  same.results = same.swarm;
  EvaluateOptions robot = options();
  robot.swarm /= "r1";
  EvaluateOptions nowhere = options();
  nowhere.results /= "nowhere";

  EXPECT_NE(message(swapped).find("out is the output of a replay, not a data set"),
            std::string::npos);
  EXPECT_NE(message(same).find("it is a data set"), std::string::npos);
  EXPECT_NE(message(robot).find("r1 is one robot's folder, the data set is above it"),
            std::string::npos);
  EXPECT_NE(message(nowhere).find("nowhere: no <observer>/<neighbor>.csv of a replay: there is no "
                                  "such directory"),
            std::string::npos);
}

TEST_F(Evaluate, SaysWhichFileIsCutOffOrEmpty) {
  write_results(0.1);
  const auto message = [&] {
    const auto text = evaluate(options());
    return text ? *text : text.error().message;
  };
  swarm_.write("truth/r2.csv", "#\n");
  EXPECT_NE(message().find("truth/r2.csv: has no rows"), std::string::npos) << message();
  swarm_.write("truth/r2.csv", "#\n0,2,0,0,1,0,0,0,0,0,0\n");
  swarm_.write("out/report.json", "{\n \"scenario\": \"ti");
  EXPECT_NE(message().find("report.json: not the whole report of a replay"), std::string::npos)
      << message();
  swarm_.write("swarm.yaml", "");
  EXPECT_NE(message().find("swarm.yaml:1: the file is empty"), std::string::npos) << message();
}

TEST_F(Evaluate, RefusesTheTruthOfAnotherRecording) {
  write_results(0.1);
  swarm_.write("out/report.json", R"({"scenario":"manual","duration_s":0.2,"clocks":[]})");
  const auto other = evaluate(options());
  swarm_.write("out/report.json", R"({"scenario":"tiny","duration_s":60.0,"clocks":[]})");
  const auto longer = evaluate(options());
  swarm_.write("out/report.json",
               R"({"scenario":"tiny","seed":9,"duration_s":0.2,"clocks":[]})");  // replay --seed

  ASSERT_FALSE(other);
  for (const char* part : {"report.json", "scenario manual", "scenario tiny"})
    EXPECT_NE(other.error().message.find(part), std::string::npos) << other.error().message;
  ASSERT_FALSE(longer);
  EXPECT_NE(longer.error().message.find("60 s"), std::string::npos) << longer.error().message;
  EXPECT_TRUE(evaluate(options()));
}

TEST_F(Evaluate, SaysThatNothingIsLeftAfterTheEnd) {
  write_results(0.1);
  EvaluateOptions late = options();
  late.after_s = 0.5;

  const auto nothing = evaluate(late);

  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::kConfig);
  EXPECT_NE(nothing.error().message.find("nothing is left after 0.5 s"), std::string::npos)
      << nothing.error().message;
}

}  // namespace
}  // namespace crepes::evaluate_test
