/// Two robots at rest, four meters apart along the observer's x axis, with the same attitude. All
/// sensors are at the origin of the body and without noise.
#pragma once

#include <cmath>
#include <numbers>

#include "estimator/core/constants.hpp"
#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/hypothesis_set.hpp"

namespace crepes::test::resting {

inline constexpr double kDistance = 4.0;  // m
inline const Pose kTruth{{kDistance, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
inline const PairMounting kMounting{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                    Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};

inline FilterSettings settings(Profile profile = Profile::kTight) {
  EstimatorSettings settings;
  settings.filters.profile = profile;
  FilterSettings filters = filter_settings(settings);
  filters.priors.speed_mps = 2.0;  // nobody passes by
  return filters;
}

inline Timestamp at_ms(std::int64_t ms) { return Timestamp{std::chrono::milliseconds{ms}}; }

/// Samples every 10 ms from 0 to `end_ms`.
inline ImuHistory imu_at_rest(int end_ms) {
  ImuHistory imu;
  for (int ms = 0; ms <= end_ms; ms += 10)
    imu.push({at_ms(ms), Eigen::Vector3d::Zero(), {0.0, 0.0, kGravityMps2}});
  return imu;
}

/// Turns by 2 rad/s about its vertical from `begin_ms` on.
inline ImuHistory imu_that_turns(int begin_ms, int end_ms) {
  ImuHistory imu = imu_at_rest(begin_ms);
  for (int ms = begin_ms + 10; ms <= end_ms; ms += 10)
    imu.push({at_ms(ms), {0.0, 0.0, 2.0}, {0.0, 0.0, kGravityMps2}});
  return imu;
}

/// A vector in the body's axes, in those after a turn of `ms`.
inline Eigen::Vector3d after_turn(const Eigen::Vector3d& v_B, int ms) {
  return Eigen::AngleAxisd(-2.0 * 1e-3 * ms, Eigen::Vector3d::UnitZ()) * v_B;
}

inline Eigen::Vector3d horizontal(double azimuth_rad) {
  return {std::cos(azimuth_rad), std::sin(azimuth_rad), 0.0};
}

inline Measurement bearing(Timestamp t, double azimuth_rad = 0.0,
                           const Eigen::Vector3d& camera = Eigen::Vector3d::Zero()) {
  return {t, MeasurementKind::kBearing, DirectionReading{horizontal(azimuth_rad), camera, 0.001}};
}

inline Measurement peer_bearing(Timestamp t, double azimuth_rad = std::numbers::pi) {
  return {t, MeasurementKind::kPeerBearing,
          DirectionReading{horizontal(azimuth_rad), Eigen::Vector3d::Zero(), 0.001}};
}

inline Measurement range(Timestamp t, double range_m = kDistance) {
  return {t, MeasurementKind::kRange, RangeReading{range_m, 0.05}};
}

inline Measurement peer_range(Timestamp t, double range_m = kDistance) {
  return {t, MeasurementKind::kPeerRange, RangeReading{range_m, 0.05}};
}

/// A mutual sighting of a robot at `azimuth_rad` that sees the observer behind itself, or at
/// `peer_azimuth_rad`: the robot, or its image in a mirror.
inline MutualInitialization sighting(double azimuth_rad = 0.0,
                                     double peer_azimuth_rad = std::numbers::pi) {
  const Sighting B{.u = horizontal(azimuth_rad),
                   .up = Eigen::Vector3d::UnitZ(),
                   .mounting = {},
                   .bearing_sigma_rad = 0.05,
                   .tilt_sigma_rad = 0.02};
  Sighting N = B;
  N.u = horizontal(peer_azimuth_rad);
  const auto raw = compute_raw_pose({.B = B, .N = N, .range_m = kDistance, .range_sigma_m = 0.07});
  return {std::get<RawPose>(raw),
          {B.u, Eigen::Vector3d::Zero(), 0.001},
          {N.u, Eigen::Vector3d::Zero(), 0.001}};
}

/// Position 0.1 m and attitude `attitude_rad`, one sigma.
inline Matrix6d covariance(double attitude_rad = 0.02) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(0.1), Eigen::Vector3d::Constant(attitude_rad);
  return sigma.cwiseAbs2().asDiagonal();
}

inline NeighborTrack track_at(Timestamp t, const GaussianPose& pose = {kTruth, covariance()}) {
  return {t, pose, OneWayInitialization{{pose}}, settings()};
}

inline Fusion fuse(NeighborTrack& track, const Measurement& z) {
  return track.fuse(z, kMounting, settings().gates);
}

}  // namespace crepes::test::resting
