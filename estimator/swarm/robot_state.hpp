/// What is known of one robot by itself.
#pragma once

#include <optional>

#include "estimator/core/measurements.hpp"
#include "estimator/relative/imu_history.hpp"
#include "estimator/relative/imu_watch.hpp"

namespace crepes {

/// A robot's motion and attitude, own or as a neighbor reports them.
struct RobotState {
  ImuHistory imu;
  std::optional<Tilt> tilt;
  ImuWatch watch{};

  /// False for a sample that says nothing or is out of place.
  bool add(const ImuSample& sample) { return watch.accept(sample) && imu.push(sample); }

  /// Whether nothing is known of its turns at `t`: no samples of late, or wrong ones.
  [[nodiscard]] bool is_blind(Timestamp t) const {
    constexpr Duration kLongest = std::chrono::milliseconds{500};
    return imu.empty() || t - imu.newest().stamp > kLongest || watch.is_at_its_end();
  }

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
