/// A message with all that a robot can report, from an explicit seed.
#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <random>

#include "estimator/core/pose.hpp"
#include "estimator/core/so3.hpp"
#include "net/mesh/peer_message.hpp"

namespace crepes::test {

inline constexpr Timestamp kSent{Duration{993'638'158'694'177}};

inline Eigen::Vector3d random_vector(std::mt19937& random, double scale) {
  std::normal_distribution<double> normal(0, scale);
  return {normal(random), normal(random), normal(random)};
}

inline Matrix6d random_covariance(std::mt19937& random) {
  Matrix6d A;
  std::normal_distribution<double> normal(0, 1);
  for (double& v : A.reshaped()) v = normal(random);
  const Vector6d scale{0.1, 0.2, 0.05, 0.01, 0.02, 0.03};
  return scale.asDiagonal() * Matrix6d(A * A.transpose() + 0.1 * Matrix6d::Identity()) *
         scale.asDiagonal();
}

/// The full report of a robot with `neighbors`: 200 ms of 100 Hz IMU, 160 ms of 50 Hz ranges, and
/// bearings from a 200 Hz camera. All of it is noise, which no code shortens.
inline OutgoingPeerMessage full_message(int neighbors, std::uint32_t seed = 1,
                                        int bearing_frames = 20) {
  std::mt19937 random(seed);
  OutgoingPeerMessage message;
  message.sent = kSent;
  message.session = 77;
  message.sequence = seed;
  Report& report = message.report;
  report.sender = RobotId{1};
  report.stamp = kSent - std::chrono::milliseconds{2};
  report.tilt = {kSent - std::chrono::milliseconds{3}, random_vector(random, 1).normalized(), 0.01};
  for (int i = 0; i < 20; ++i)
    report.imu.push_back({kSent - std::chrono::milliseconds{10 * i}, random_vector(random, 1.5),
                          Eigen::Vector3d(0, 0, 9.81) + random_vector(random, 2)});
  for (int n = 0; n < neighbors; ++n) {
    const RobotId neighbor{static_cast<std::uint16_t>(n + 2)};
    message.echoes.push_back(
        {neighbor, 1'000'000U + static_cast<unsigned>(n), to_ns(kSent) - 40'000'000, 0.1});
    for (int i = 0; i < bearing_frames; ++i)
      report.bearings.push_back({kSent - std::chrono::milliseconds{5 * i},
                                 neighbor,
                                 random_vector(random, 1).normalized(),
                                 {0.06, 0.0, 0.04},
                                 7e-4});
    for (int i = 0; i < 8; ++i)
      report.ranges.push_back(
          {kSent - std::chrono::milliseconds{20 * i + n % 7}, neighbor, 3.0 + n, -81.5, -78.0});
    NeighborEstimate estimate;
    estimate.stamp = kSent - std::chrono::milliseconds{4};
    estimate.neighbor = neighbor;
    estimate.T_B_N.pose = {random_vector(random, 5), so3_exp(random_vector(random, 1))};
    estimate.T_B_N.covariance = random_covariance(random);
    estimate.v_B_N = random_vector(random, 1);
    report.estimates.push_back(estimate);
  }
  return message;
}

}  // namespace crepes::test
