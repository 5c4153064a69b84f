/// Bearings from a camera that exposes its rows one after the other.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <random>

#include "estimator/vision/blink_tracker.hpp"
#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/id_library.hpp"
#include "tests/estimator/vision/blink_tracker_fixture.hpp"

namespace crepes::rolling_shutter_test {
namespace {

using test::BlinkTrackerTest;

/// A board that shines always but in one slot, seen by a camera that turns to and fro by up to 2.6
/// rad/s. Rows are exposed one after the other, or all at once if `row_us` is 0. `configured_us` is
/// the tracker's setting. Returns the root mean square error of the bearings [px].
double error_of_a_turning_camera(double row_us, double configured_us, std::uint32_t seed) {
  constexpr double kTurn = 2.6;
  constexpr double kPace = 4.0;  // rad/s
  constexpr double kNoise = 0.03;
  CameraCalibration config = BlinkTrackerTest::camera();
  config.T_cam_imu.p.setZero();
  config.rolling_shutter_us_per_row = configured_us;
  const CameraModel model = *CameraModel::from(config);
  const IdLibrary library = *IdLibrary::from(BlinkTrackerTest::swarm());
  BlinkTracker tracker(config, model, VisionConfig{}, library);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, kNoise);
  const double height = std::uniform_real_distribution<double>(0.3, 0.7)(random);
  const Eigen::Vector3d u_W = Eigen::Vector3d(1.0, 0.1, seed % 2 == 0 ? height : -height);
  const auto u_B = [&](double t) {
    const double yaw = kTurn / kPace * std::sin(kPace * t);
    return Eigen::Vector3d(Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()) * u_W.normalized());
  };
  double sum = 0.0;
  int count = 0;
  for (double t = 0.0; t < 3.0; t += 0.005) {
    ImuSample imu;
    imu.stamp = Timestamp{from_seconds(100.002 + t)};
    imu.gyro_radps.z() = kTurn * std::cos(kPace * (t - 0.0025));
    tracker.add_imu(imu);
    double exposed = t;
    for (int round = 0; round < 3; ++round)
      exposed = t + 1e-6 * row_us *
                        (model.project(config.T_cam_imu.q * u_B(exposed))->y() -
                         0.5 * (model.height() - 1));
    SpotFrame frame{.stamp = Timestamp{from_seconds(100.0 + t)}, .camera = 0, .spots = {}};
    if (library.entries()[0].code.is_lit(from_seconds(200.002 + exposed))) {
      const Eigen::Vector2d uv = *model.project(config.T_cam_imu.q * u_B(exposed));
      frame.spots.push_back({uv.x() + noise(random), uv.y() + noise(random), 12.0, 255.0});
    }
    for (const Bearing& bearing : tracker.step(frame)) {
      sum += (*model.project(config.T_cam_imu.q * bearing.u_B) -
              *model.project(config.T_cam_imu.q * u_B(t)))
                 .squaredNorm();
      ++count;
    }
  }
  EXPECT_GT(count, 250) << "of some 600 frames";
  return std::sqrt(sum / count);
}

TEST(BlinkTracker, TurnsWhatARollingShutterSawToTheStampOfTheFrame) {
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    const double global = error_of_a_turning_camera(0.0, 0.0, seed);

    EXPECT_LT(error_of_a_turning_camera(4.4, 4.4, seed), 1.1 * global) << "seed " << seed;
    EXPECT_LT(error_of_a_turning_camera(-4.4, -4.4, seed), 1.1 * global) << "bottom row first";
    EXPECT_GT(error_of_a_turning_camera(4.4, 0.0, seed), 5.0 * global) << "it is not configured";
    EXPECT_GT(error_of_a_turning_camera(4.4, -4.4, seed), 10.0 * global) << "the wrong way round";
  }
}

}  // namespace
}  // namespace crepes::rolling_shutter_test
