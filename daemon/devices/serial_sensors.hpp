/// The ranging module and the inertial sensor on their serial ports.
#pragma once

#include <string>

#include "config/schema/config.hpp"
#include "daemon/devices/sensor.hpp"
#include "daemon/stages/stage_context.hpp"
#include "drivers/imu/imu_config.hpp"
#include "drivers/serial/device_name.hpp"
#include "drivers/uwb/uwb_config.hpp"
#include "drivers/uwb/uwb_ranges.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Everything that the ranging module needs of the configuration.
struct UwbSensorSettings {
  UwbDeviceConfig device;
  UwbModules modules;
  std::optional<std::uint32_t> own_module = std::nullopt;  ///< this robot's
  double max_range_m = 0.0;                                ///< ranges above are refused

  [[nodiscard]] bool operator==(const UwbSensorSettings&) const = default;
};

/// Everything that the inertial sensor needs of the configuration.
struct ImuSensorSettings {
  ImuDeviceConfig device;
  double rate_hz = 0.0;  ///< expected sample rate

  [[nodiscard]] bool operator==(const ImuSensorSettings&) const = default;
};

[[nodiscard]] UwbSensorSettings uwb_sensor_settings(const Config& config);
[[nodiscard]] ImuSensorSettings imu_sensor_settings(const Config& config);

/// `clock` and `name` must outlive the sensor. `name` identifies a device that was unplugged and
/// has returned under another name. It is the same one for each new sensor of the same kind, so
/// that new settings do not lose the device.
[[nodiscard]] Sensor uwb_sensor(const UwbSensorSettings& settings, const Clock& clock,
                                const EventSink& sink, DeviceName& name);
[[nodiscard]] Sensor imu_sensor(const ImuSensorSettings& settings, const Clock& clock,
                                const EventSink& sink, DeviceName& name);

}  // namespace crepes
