#include "daemon/ctl/calibrate/calibrate_imu.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <vector>

#include "drivers/imu/imu_correction.hpp"
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

TEST_F(Calibrate, ReplacesTheImusCorrectionThatWasInForce) {
  const auto recording = simulated::imu_protocol(1, {}, ImuNoise{});
  std::ofstream(etc() / "crepesd.d" / "10-imu.yaml")
      << "imu:\n  T_body_imu: [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]\n"
         "  accelerometer: {bias: [0.1, 0.2, -0.3], scale: [1.02, 0.98, 1.01]}\n"
         "  gyroscope: {bias: [0.01, 0.02, -0.03], scale: [0.99, 1, 1.01]}\n";
  const ImuCorrection in_force(config().imu.device);
  std::vector<ImuSample> recorded;
  for (const ImuSample& sample : recording.samples) recorded.push_back(in_force.apply(sample));
  write_robot(1, recorded);
  const fs::path out = scratch_.path() / "imu.yaml";

  const auto report = calibrate_imu({.robot_dir = robot_dir(1), .out = out});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->reasons.empty()) << report->reasons.front();
  fs::copy_file(out, etc() / "crepesd.d" / "20-imu.yaml");
  const ImuDeviceConfig imu = config().imu.device;
  const auto T_K = [](const TriadConfig& triad) -> Eigen::Matrix3d {
    return triad.misalignment * triad.scale.asDiagonal();
  };
  EXPECT_LT((imu.accelerometer.bias - recording.errors.accel_bias).norm(), 3e-3);  // m/s^2
  EXPECT_LT((imu.gyroscope.bias - recording.errors.gyro_bias).norm(), 1e-3);       // rad/s
  EXPECT_TRUE((T_K(imu.accelerometer) * recording.errors.S_accel).isIdentity(1e-3));
  EXPECT_TRUE((T_K(imu.gyroscope) * recording.errors.S_gyro).isIdentity(3e-3));
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
