/// The IMU and tilt of one robot.
#pragma once

#include <cmath>
#include <optional>
#include <utility>

#include "estimator/core/imu_history.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/relative/imu_guard.hpp"

namespace crepes {

/// Own measurements, or those in a neighbor's reports.
struct RobotState {
  /// An IMU without samples for longer does not show the motion.
  static constexpr Duration kImuSilence = std::chrono::milliseconds{500};

  ImuHistory imu;
  std::optional<Tilt> tilt;
  ImuGuard guard{};
  Timestamp refused_until = Timestamp::min();  ///< the team found its gyroscope false

  /// Adds a sample that the guard believes, and the rates that it keeps before it. False for a
  /// duplicate, and for a late sample that contradicts those about it.
  bool add_believed(const ImuSample& sample) {
    constexpr Duration kAbout = std::chrono::milliseconds{5};
    const bool is_late = !imu.empty() && sample.stamp < imu.newest().stamp;
    if (is_late && !guard.agrees(sample, imu.mean(sample.stamp - kAbout, sample.stamp)))
      return false;
    const Eigen::Vector3d blow_mps = guard.blow_mps(sample);
    const auto rates = guard.rates_before(sample);
    if (rates.empty() || imu.empty()) return imu.push(sample, blow_mps);
    // The blow came somewhere among them.
    const Timestamp before = imu.newest().stamp;
    Timestamp last = before;
    const auto part = [&](Timestamp stamp) {
      const Duration passed = stamp - std::exchange(last, stamp);
      return std::sqrt(to_seconds(passed) / to_seconds(sample.stamp - before)) * blow_mps;
    };
    for (const KeptRate& rate : rates)
      imu.push(rate.sample, part(rate.sample.stamp), rate.turn_rad);
    return imu.push(sample, part(sample.stamp));
  }

  /// True if the IMU does not show the motion at `t`: it is silent, a sensor is saturated, or the
  /// gyroscope contradicts the cameras.
  [[nodiscard]] bool lacks_imu(Timestamp t) const {
    return imu.empty() || t - imu.newest().stamp > kImuSilence || guard.is_saturated() ||
           t < refused_until;
  }

  /// The tilt propagated by the gyroscope to `t`, at most a second away. Empty without tilt or
  /// samples, and where samples are missing for long: how far the robot turned there is unknown.
  [[nodiscard]] std::optional<Tilt> tilt_at(Timestamp t) const {
    constexpr Duration kMaxPropagation = std::chrono::seconds{1};
    constexpr Duration kMaxExtrapolation = std::chrono::milliseconds{100};
    if (!tilt || imu.empty()) return std::nullopt;
    if (t > tilt->stamp + kMaxPropagation || t < tilt->stamp - kMaxPropagation) return std::nullopt;
    if (imu.extrapolated(tilt->stamp, t) > kMaxExtrapolation) return std::nullopt;
    Tilt propagated = *tilt;
    propagated.stamp = t;
    propagated.up_B = imu.rotation(tilt->stamp, t).conjugate() * tilt->up_B;
    return propagated;
  }
};

}  // namespace crepes
