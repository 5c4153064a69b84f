#include "daemon/ctl/calibrate/calibrate_range.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/calibrate/tape.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "tests/daemon/ctl/calibrate/calibrate_fixture.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes::calibrate_range_test {
namespace {

namespace fs = std::filesystem;

/// Robots at rest in a triangle of 3, 4 and 5 m, whose modules have antenna delays.
class CalibrateRange : public test::Calibrate {
 protected:
  /// The first robot may turn all the time.
  void write_swarm(int robots, double turn_radps = 0.0) const {
    std::ostringstream swarm;
    swarm << "scenario: rest\nseed: 1\nduration_s: 21\n"
             "network: {latency_ms: 3.0, jitter_ms: 2.0, loss: 0.0, seed: 7}\nrobots:\n";
    for (int id = 1; id <= robots; ++id) {
      swarm << "- {id: " << id << ", name: r" << id << ", dir: r" << id
            << ", clock: {offset_s: 0.0, skew_ppm: 0.0}}\n";
      const ImuSample sample{.stamp = Timestamp{},
                             .gyro_radps = {0.0, 0.0, id == 1 ? turn_radps : 0.0},
                             .accel_mps2 = {0.0, 0.0, 9.81}};
      write_robot(id, {sample});
      RobotFolder folder(robot_dir(id));
      ASSERT_TRUE(folder.append("uwb0", ranges_of(id, robots)));
      std::string no_spots;
      append_rows(no_spots, SpotFrame{.stamp = Timestamp{}, .camera = 0, .spots = {}});
      ASSERT_TRUE(folder.append("cam0", no_spots));
    }
    std::ofstream(scratch_.path() / "swarm.yaml") << swarm.str();
    std::ofstream tape(scratch_.path() / "tape.yaml");
    tape << "segments:\n- {from_s: 0, to_s: 20, pairs: [{ids: [1, 2], distance_m: 3.0}";
    if (robots == 3) tape << ", {ids: [2, 3], distance_m: 4.0}, {ids: [1, 3], distance_m: 5.0}";
    tape << "]}\n";
  }

  [[nodiscard]] Result<CalibrationReport> run() const {
    return calibrate_range({.swarm_dir = scratch_.path(),
                            .tape = scratch_.path() / "tape.yaml",
                            .out = etc() / "ranges.yaml"});
  }
  [[nodiscard]] Result<CalibrationReport> run_with(
      const std::vector<std::string>& distances) const {
    return calibrate_range(
        {.swarm_dir = scratch_.path(), .distances = distances, .out = etc() / "ranges.yaml"});
  }
  /// What the command is for: the fragment where the daemon reads it.
  [[nodiscard]] Config config_with_fragment() const {
    fs::copy_file(etc() / "ranges.members.yaml", etc() / "crepesd.d" / "30-ranges.yaml");
    return config();
  }

  static constexpr std::array<double, 4> kDelays{0.0, 0.10, 0.25, -0.05};  // by id

 private:
  [[nodiscard]] static std::string ranges_of(int id, int robots) {
    simulated::Dice dice(static_cast<std::uint64_t>(id));
    std::string rows;
    for (int i = 0; i < 400; ++i) {
      for (int other = 1; other <= robots; ++other) {
        if (other == id) continue;
        const double distance = id + other == 3 ? 3.0 : id + other == 5 ? 4.0 : 5.0;
        append_rows(rows, UwbRange{.stamp = Timestamp{std::chrono::milliseconds{50 * i}},
                                   .neighbor = RobotId{static_cast<std::uint16_t>(other)},
                                   .range_m = distance + kDelays.at(static_cast<std::size_t>(id)) +
                                              kDelays.at(static_cast<std::size_t>(other)) +
                                              dice.normal(0.05),
                                   .first_path_dbm = -81.0,
                                   .received_dbm = -79.0});
      }
    }
    return rows;
  }
};

TEST_F(CalibrateRange, WritesTheAntennaDelayOfEveryModule) {
  write_swarm(3);

  const auto report = run();

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->reasons.empty()) << report->reasons.front();
  const Config config = config_with_fragment();
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(config.swarm.members[i].range_delay_m, kDelays.at(i + 1), 0.01) << i;
  EXPECT_LT(config.uwb.noise.bias_sigma_m, 0.1);
  EXPECT_EQ(config.swarm.members[1].name, "r2");
}

TEST_F(CalibrateRange, NamesARobotThatDidNotRestAtItsTapedDistance) {
  write_swarm(2, 0.5);
  const auto moved = run();
  write_swarm(2, 0.05);
  const auto resting = run();

  ASSERT_TRUE(moved && resting);
  EXPECT_NE(moved->text.find("warning: turned: r1 in segment 1 (29 deg/s RMS)"), std::string::npos)
      << moved->text;
  EXPECT_EQ(resting->text.find("warning: turned"), std::string::npos) << resting->text;
}

TEST_F(CalibrateRange, GivesEachOfTwoRobotsHalfOfTheirBias) {
  write_swarm(2);

  const auto report = run();

  ASSERT_TRUE(report) << report.error().message;
  const Config config = config_with_fragment();
  EXPECT_NEAR(config.swarm.members[0].range_delay_m, 0.175, 0.01);
  EXPECT_EQ(config.swarm.members[0].range_delay_m, config.swarm.members[1].range_delay_m);
  EXPECT_EQ(config.swarm.members[2].range_delay_m, 0.0);
}

TEST_F(CalibrateRange, LeavesTheSizeOfBiasesAloneWherePairsDoNotDetermineTheModules) {
  write_swarm(3);
  const double configured_m = this->config().uwb.noise.bias_sigma_m;

  const auto report = run_with({"r1,r2=3.00", "1,3=5.00"});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_NE(report->text.find("bias_sigma_m"), std::string::npos) << report->text;
  const Config config = config_with_fragment();
  const auto delay_m = [&](std::size_t i) { return config.swarm.members[i].range_delay_m; };
  EXPECT_NEAR(delay_m(0) + delay_m(1), kDelays.at(1) + kDelays.at(2), 0.01);
  EXPECT_NEAR(delay_m(0) + delay_m(2), kDelays.at(1) + kDelays.at(3), 0.01);
  EXPECT_EQ(config.uwb.noise.bias_sigma_m, configured_m);
}

TEST_F(CalibrateRange, TakesDistancesFromTheCommandLineByNameOrId) {
  write_swarm(3);

  const auto report = run_with({"r1,r2=3.00", "3,r2=4.00", "1,3=5.00"});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->reasons.empty()) << report->reasons.front();
  const Config config = config_with_fragment();
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(config.swarm.members[i].range_delay_m, kDelays.at(i + 1), 0.01) << i;
  EXPECT_NE(report->text.find("ranges.members.yaml"), std::string::npos);
}

TEST_F(CalibrateRange, ReplacesItsEarlierResultsButNoOtherFileUnlessForced) {
  write_swarm(2);
  ASSERT_TRUE(run());
  EXPECT_TRUE(run());

  std::ofstream(etc() / "ranges.members.yaml") << "swarm: {members: []}  # measured by hand\n";
  const auto refused = run();

  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("ranges.members.yaml: exists"), std::string::npos)
      << refused.error().message;
  EXPECT_TRUE(calibrate_range({.swarm_dir = scratch_.path(),
                               .tape = scratch_.path() / "tape.yaml",
                               .out = etc() / "ranges.yaml",
                               .force = true}));
}

TEST_F(CalibrateRange, SaysWhatIsWrongWithADistance) {
  write_swarm(2);
  for (const std::string text : {"r1=3.0", "r1,r9=3.0", "r1,r1=3.0", "r1,r2=far", "r1,r2=-3"}) {
    const auto report = run_with({text});
    ASSERT_FALSE(report) << text;
    EXPECT_EQ(report.error().code, ErrorCode::kUsage);
    EXPECT_NE(report.error().message.find(text), std::string::npos) << report.error().message;
  }
}

TEST_F(CalibrateRange, NamesTheLineOfATapeWithoutSegments) {
  const auto refused = [this](const std::string& text) {
    std::ofstream(scratch_.path() / "tape.yaml") << text;
    const auto tape = load_tape(scratch_.path() / "tape.yaml");
    return tape ? std::string("none") : tape.error().message;
  };

  EXPECT_NE(refused("").find("tape.yaml:1: segments: is missing"), std::string::npos);
  EXPECT_NE(refused("segments: []\n").find("tape.yaml:1: segments: is an empty list"),
            std::string::npos);
}

TEST_F(CalibrateRange, WarnsOfATapeThatIsHalfAMeterWrong) {
  write_swarm(3);

  const auto wrong = run_with({"r2,r3=3.50", "r1,r3=4.50"});
  const auto right = run_with({"r2,r3=4.00", "r1,r3=5.00"});

  ASSERT_TRUE(wrong && right);
  EXPECT_NE(wrong->text.find("pair 1,3: 0.55 m instead of 0.00 m, pair 2,3: 0.70 m"),
            std::string::npos)
      << wrong->text;
  EXPECT_EQ(right->text.find("is the tape right"), std::string::npos) << right->text;
}

TEST_F(CalibrateRange, WritesTheNoiseThatTheRangesHave) {
  write_swarm(3);

  ASSERT_TRUE(run());

  const RangeNoise noise = config_with_fragment().uwb.noise;
  EXPECT_NEAR(noise.noise_m, 0.05, 0.005);
  EXPECT_LT(noise.bias_drift_m, 0.03);
}

}  // namespace
}  // namespace crepes::calibrate_range_test
