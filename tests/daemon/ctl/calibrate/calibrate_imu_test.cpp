#include "daemon/ctl/calibrate/calibrate_imu.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <filesystem>

#include "tests/daemon/ctl/calibrate/calibrate_fixture.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes::calibrate_imu_test {
namespace {

namespace fs = std::filesystem;
using test::Calibrate;

TEST_F(Calibrate, WritesWhatTheImuIsOffByAsAFragment) {
  const ImuNoise noise;
  const auto recording = simulated::imu_protocol(1, {}, noise);
  write_robot(1, recording.samples);
  const fs::path out = scratch_.path() / "imu.yaml";

  const auto report = calibrate_imu({.robot_dir = robot_dir(1), .out = out});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->reasons.empty()) << report->reasons.front();
  fs::copy_file(out, etc() / "crepesd.d" / "20-imu.yaml");
  const ImuDeviceConfig imu = config().imu.device;
  const Eigen::Matrix3d T_K = imu.accelerometer.misalignment * imu.accelerometer.scale.asDiagonal();
  EXPECT_LT((imu.accelerometer.bias - recording.errors.accel_bias).norm(), 3e-3);  // m/s^2
  EXPECT_TRUE((T_K * recording.errors.S_accel).isIdentity(1e-3));
  EXPECT_TRUE(fs::exists(scratch_.path() / "imu.kalibr.yaml"));
}

TEST_F(Calibrate, RefusesTooFewAttitudes) {
  const auto recording = simulated::imu_protocol(1, {.attitudes = 4}, ImuNoise{});
  write_robot(1, recording.samples);
  const fs::path out = scratch_.path() / "imu.yaml";

  const auto report = calibrate_imu({.robot_dir = robot_dir(1), .out = out});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(report->reasons.empty());
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace crepes::calibrate_imu_test
