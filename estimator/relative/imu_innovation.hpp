/// How far an inertial sample is from what the ones before it lead to expect.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// One number each for gyroscope and accelerometer.
struct PerSensor {
  double gyro = 0.0;
  double accel = 0.0;

  [[nodiscard]] double most() const { return gyro > accel ? gyro : accel; }
};

/// The larger of each.
[[nodiscard]] PerSensor largest(const PerSensor& a, const PerSensor& b);
/// True if neither exceeds its limit.
[[nodiscard]] bool is_within(const PerSensor& size, const PerSensor& most);
/// The norms of the differences [rad/s, m/s^2].
[[nodiscard]] PerSensor distance(const ImuSample& a, const ImuSample& b);

/// The samples that predict the next one.
struct ImuReference {
  ImuSample last;
  std::optional<ImuSample> before;

  /// The time since the last sample, in periods, at most ten.
  [[nodiscard]] double steps_to(Timestamp stamp) const;
};

/// The smaller difference from two predictions: a swing continues, a vibration does not.
[[nodiscard]] PerSensor innovation(const ImuSample& sample, const ImuReference& reference);

/// The median of the latest innovations of a sensor: a scale that outliers do not move (Huber and
/// Ronchetti 2009, "Robust Statistics", 5.1).
class InnovationScale {
 public:
  /// Adds the size of an innovation.
  void add(double size);
  [[nodiscard]] double median() const { return median_; }
  /// False before there are enough.
  [[nodiscard]] bool is_known() const { return is_known_; }

 private:
  static constexpr std::size_t kKept = 64;
  static constexpr std::size_t kLeast = 16;
  std::array<double, kKept> sizes_{};
  std::size_t count_ = 0;
  double median_ = 0.0;
  bool is_known_ = false;
};

}  // namespace crepes
