#include "daemon/ctl/calibrate/calibrate_swarm.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "config/reading/config_file.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/core/constants.hpp"
#include "tests/daemon/ctl/calibrate/calibrate_fixture.hpp"
#include "tests/support/calibration_swarm.hpp"

namespace crepes::calibrate_swarm_test {
namespace {

namespace fs = std::filesystem;

/// Robots that fly in view of each other, with configurations that are a little off.
class CalibrateSwarm : public test::Calibrate {
 protected:
  void write_flight(const simulated::SwarmFlight& flight) const {
    std::ostringstream swarm;
    swarm << "scenario: flight\nseed: 1\nduration_s: 20\n"
             "network: {latency_ms: 3.0, jitter_ms: 2.0, loss: 0.0, seed: 7}\nrobots:\n";
    for (std::size_t r = 0; r < flight.records.size(); ++r) {
      swarm << "- {id: " << r + 1 << ", name: r" << r + 1 << ", dir: r" << r + 1
            << ", clock: {offset_s: " << 2.0 * static_cast<double>(r) << ", skew_ppm: 0.0}}\n";
      write_flown(flight, r);
    }
    ASSERT_TRUE(write_text_file(scratch_.path() / "swarm.yaml", swarm.str()));
  }

  [[nodiscard]] Result<CalibrationReport> calibrate_flight() const {
    return calibrate_swarm(
        {.swarm_dir = scratch_.path(), .out = out(), .json = true, .on_progress = {}});
  }
  [[nodiscard]] fs::path out() const { return scratch_.path() / "swarm"; }

 private:
  void write_flown(const simulated::SwarmFlight& flight, std::size_t r) const {
    const RobotConstants& guess = flight.guess[r];
    RobotFolder folder(robot_dir(static_cast<int>(r) + 1));
    Config own = config();
    own.robot.id = RobotId{static_cast<std::uint16_t>(r + 1)};
    CameraCalibration& camera = own.cameras[0].calibration;
    camera.intrinsics.assign(guess.camera.lens.begin(), guess.camera.lens.end());
    camera.resolution = {1280, 1024};
    camera.T_cam_imu = guess.camera.T_C_B();
    camera.calibrated = true;
    for (MemberConfig& member : own.swarm.members) {
      member.p_body_led = guess.p_B_M;
      member.p_body_uwb = guess.p_B_U;
    }
    ASSERT_TRUE(folder.write_config(write_config(own)));
    const Duration ahead = std::chrono::seconds(2 * r);
    std::string imu;
    for (ImuSample sample : flight.records[r].imu) {
      sample.stamp += ahead;
      append_rows(imu, sample);
    }
    ASSERT_TRUE(folder.append("imu0", imu));
    std::string ranges;
    for (const RobotRange& range : flight.records[r].ranges)
      append_rows(ranges, UwbRange{.stamp = range.stamp + ahead,
                                   .neighbor = RobotId{static_cast<std::uint16_t>(range.other + 1)},
                                   .range_m = range.range_m,
                                   .first_path_dbm = -80.0,
                                   .received_dbm = -79.0});
    ASSERT_TRUE(folder.append("uwb0", ranges));
    ASSERT_TRUE(folder.append("cam0", blinking(flight.records[r].sightings, own, ahead)));
  }

  static std::string blinking(const std::vector<BoardSighting>& sightings, const Config& own,
                              Duration ahead) {
    constexpr double kSlot = 10e-3;
    std::map<Timestamp, SpotFrame> frames;
    for (const BoardSighting& sighting : sightings) {
      SpotFrame& frame = frames[sighting.stamp];
      frame.stamp = sighting.stamp + ahead;
      const std::string& pattern = *own.swarm.members.at(sighting.board).pattern;
      const double t_s = to_seconds(sighting.stamp.time_since_epoch()) +
                         0.0037 * static_cast<double>(1 + sighting.board);
      const auto slot = static_cast<std::size_t>(t_s / kSlot) % pattern.size();
      if (pattern[slot] == '1')
        frame.spots.push_back({sighting.uv.x(), sighting.uv.y(), 12.0, 200.0, 1.0});
    }
    std::string rows;
    for (const auto& [stamp, frame] : frames) append_rows(rows, frame);
    return rows;
  }
};

TEST_F(CalibrateSwarm, WritesAFragmentForEveryRobot) {
  const auto flight = simulated::fly(6, {.camera_rate_hz = 200.0, .outliers = 0.0}, ImuNoise{});
  write_flight(flight);

  const auto report = calibrate_flight();

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_TRUE(report->reasons.empty()) << report->reasons.front();
  EXPECT_TRUE(fs::exists(out() / "r3.yaml"));
  fs::copy_file(out() / "r1.fragment.yaml", etc() / "crepesd.d" / "20-swarm.yaml");
  const Config found = config();
  const CameraCalibration& camera = found.cameras[0].calibration;
  const RobotConstants& truth = flight.truth[0];
  EXPECT_TRUE(camera.calibrated);
  EXPECT_LT(kDegPerRad * camera.T_cam_imu.q.angularDistance(truth.camera.q_C_B), 0.4);
  EXPECT_NEAR(camera.timeshift_cam_imu, truth.camera.shift_s, 5e-4);
  for (std::size_t r = 0; r < 3; ++r)
    EXPECT_LT((found.swarm.members[r].p_body_led - flight.truth[r].p_B_M).norm(), 0.015) << r;
  EXPECT_TRUE(nlohmann::json::parse(report->text)["ok"]);
}

TEST_F(CalibrateSwarm, WritesNothingFromFiveSeconds) {
  write_flight(
      simulated::fly(6, {.duration_s = 5.0, .camera_rate_hz = 200.0, .outliers = 0.0}, ImuNoise{}));

  const auto report = calibrate_flight();

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(report->reasons.empty());
  EXPECT_FALSE(fs::exists(out()));
}

}  // namespace
}  // namespace crepes::calibrate_swarm_test
