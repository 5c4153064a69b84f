/// What is known of one robot by itself.
#pragma once

#include <optional>

#include "estimator/core/measurements.hpp"
#include "estimator/relative/imu_history.hpp"

namespace crepes {

/// A robot's motion and attitude, own or as a neighbor reports them.
struct RobotState {
  ImuHistory imu;
  std::optional<Tilt> tilt;

  /// The tilt carried to another instant, at most a second away, by the gyroscope. Empty without
  /// tilt or samples.
  [[nodiscard]] std::optional<Tilt> tilt_at(Timestamp t) const {
    constexpr Duration kMaxCarry = std::chrono::seconds{1};
    if (!tilt || imu.empty()) return std::nullopt;
    if (t > tilt->stamp + kMaxCarry || t < tilt->stamp - kMaxCarry) return std::nullopt;
    Tilt moved = *tilt;
    moved.stamp = t;
    moved.up_B = imu.rotation(tilt->stamp, t).conjugate() * tilt->up_B;
    return moved;
  }
};

}  // namespace crepes
