/// What every inertial sensor's samples go through before they are events.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/devices/serial_sensors.hpp"
#include "drivers/base/sensor_totals.hpp"
#include "drivers/imu/bundle_spacing.hpp"
#include "drivers/imu/imu_correction.hpp"
#include "drivers/imu/imu_health.hpp"
#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// An autopilot may send numbers without a unit beside samples.
[[nodiscard]] SensorTotals totals_of(const ImuCounts& counts);

/// Spacing, health check and correction of samples that were read at once.
class ImuPreprocessing {
 public:
  explicit ImuPreprocessing(const ImuSensorSettings& settings);

  void apply(std::vector<ImuSample>& bundle);

  [[nodiscard]] Totals faults() const;
  /// How strongly it is pulled and how fast it turns, after the correction: at rest 9.81 m/s^2 and
  /// nothing.
  [[nodiscard]] Totals counts() const;
  [[nodiscard]] std::optional<std::string> diagnosis() const;

 private:
  BundleSpacing spacing_;
  ImuHealth health_;
  ImuCorrection correction_;
  std::uint64_t samples_ = 0;
  double force_mps2_ = 0.0;
  double turn_radps_ = 0.0;
};

}  // namespace crepes
