/// An inertial sensor of the Linux kernel (IIO) as a sensor.
#pragma once

#include "daemon/devices/serial_sensors.hpp"
#include "drivers/iio/iio_devices.hpp"

namespace crepes {

/// `settings.device.port` as for `choose_iio_imu`. `clock` must outlive the sensor.
[[nodiscard]] Sensor iio_sensor(const ImuSensorSettings& settings, const Clock& clock,
                                const EventSink& sink, const IioPaths& paths = {});

}  // namespace crepes
