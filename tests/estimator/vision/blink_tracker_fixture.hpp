/// What the tests of the blink tracker begin with: boards in front of a camera.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "estimator/vision/blink_tracker.hpp"
#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes::test {

/// Boards and lamps in front of one camera at 200 Hz; positions in a world whose axes are the
/// body's at rest, origin at the body.
class BlinkTrackerTest : public testing::Test {
 public:
  static SwarmConfig swarm() {
    SwarmConfig swarm;
    for (const char* pattern : {"001001011111111111", "001010101111111111", "001011110011111111"}) {
      MemberConfig member;
      member.id = RobotId{static_cast<std::uint16_t>(swarm.members.size() + 1)};
      member.pattern = pattern;
      swarm.members.push_back(member);
    }
    return swarm;
  }
  static CameraCalibration camera() {
    CameraCalibration config;
    config.name = "cam0";
    config.intrinsics = {-0.1723, 0.5931, 316.9, 316.8, 638.2, 512.5};
    config.resolution = {1280, 1024};
    Eigen::Matrix3d R_C_B;
    R_C_B << 0, -1, 0, 0, 0, -1, 1, 0, 0;
    config.T_cam_imu = {Eigen::Vector3d(0.0, 0.01, -0.06), Eigen::Quaterniond(R_C_B)};
    config.timeshift_cam_imu = 0.002;
    return config;
  }

 protected:
  struct Board {
    std::size_t code;  ///< index into the library
    std::function<Eigen::Vector3d(double)> p_W;
  };

  /// What the tracker makes of the next frame; nothing if the frame is lost.
  std::vector<Bearing> step(bool is_lost = false) {
    now_ += std::chrono::milliseconds{5};
    const Timestamp body = now_ + std::chrono::milliseconds{2};
    const double t = to_seconds(body.time_since_epoch()) - 100.0;
    q_W_B_ = Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rate_radps_ * t, Eigen::Vector3d::UnitZ()));
    ImuSample imu;
    imu.stamp = body;
    imu.gyro_radps = {0.0, 0.0, yaw_rate_radps_};
    tracker_.add_imu(imu);

    SpotFrame frame;
    frame.stamp = now_;
    std::normal_distribution<double> noise(0.0, jitter_px_);
    for (std::size_t i = 0; i < boards_.size(); ++i) {
      const Board& board = boards_[i];
      if (board.code < 3 && !library_.entries()[board.code].code.is_lit(body.time_since_epoch() +
                                                                        Duration{i * 37'000'000}))
        continue;
      const Eigen::Vector3d p_B = q_W_B_.conjugate() * board.p_W(t);
      const auto uv = model_.project(camera_.T_cam_imu * p_B);
      if (uv && model_.contains(*uv))
        frame.spots.push_back({uv->x() + noise(random_), uv->y() + noise(random_), 12.0, 255.0});
    }
    // Two boards within a few pixels are one spot.
    for (std::size_t i = 0; i + 1 < frame.spots.size(); ++i)
      for (std::size_t j = i + 1; j < frame.spots.size(); ++j)
        if (std::hypot(frame.spots[i].u_px - frame.spots[j].u_px,
                       frame.spots[i].v_px - frame.spots[j].v_px) < 4.0) {
          frame.spots[i].u_px = 0.5 * (frame.spots[i].u_px + frame.spots[j].u_px);
          frame.spots[i].v_px = 0.5 * (frame.spots[i].v_px + frame.spots[j].v_px);
          frame.spots.erase(frame.spots.begin() + static_cast<std::ptrdiff_t>(j--));
        }
    std::shuffle(frame.spots.begin(), frame.spots.end(), random_);
    frame_ = frame;
    return is_lost ? std::vector<Bearing>{} : tracker_.step(frame, expected_);
  }

  /// Its robot's pose says where the board is, within 1 cm.
  ExpectedBoard pose_of(std::size_t board, double v_y_mps = 0.0) const {
    const double t = to_seconds(now_.time_since_epoch()) - 100.0;
    return {.robot = RobotId{static_cast<std::uint16_t>(board + 1)},
            .stamp = now_,
            .p_B_M = q_W_B_.conjugate() * boards_[board].p_W(t),
            .v_B_M = q_W_B_.conjugate() * Eigen::Vector3d(0.0, v_y_mps, 0.0),
            .covariance_m2 = 1e-4 * Eigen::Matrix3d::Identity()};
  }

  /// Angle between a bearing and the board it names [rad].
  double error_of(const Bearing& bearing, std::size_t board) const {
    const double t = to_seconds(bearing.stamp.time_since_epoch()) - 100.0;
    const Eigen::Vector3d p_B = q_W_B_.conjugate() * boards_[board].p_W(t);
    return std::acos(std::min(1.0, (p_B - bearing.p_B_C).normalized().dot(bearing.u_B)));
  }

  CameraCalibration camera_ = camera();
  CameraModel model_ = *CameraModel::from(camera_);
  IdLibrary library_ = *IdLibrary::from(swarm());
  BlinkTracker tracker_{camera_, model_, VisionConfig{}, library_};
  std::vector<Board> boards_;
  std::vector<ExpectedBoard> expected_;
  double yaw_rate_radps_ = 0.0;
  double jitter_px_ = 0.2;
  Eigen::Quaterniond q_W_B_ = Eigen::Quaterniond::Identity();
  Timestamp now_{std::chrono::seconds{100}};
  SpotFrame frame_;
  std::mt19937 random_{5};
};

}  // namespace crepes::test
