/// An IMU's calibration as keys of `crepesd.yaml`.
#pragma once

#include <string>
#include <string_view>

#include "drivers/imu/imu_config.hpp"
#include "estimator/calibration/imu/imu_calibration.hpp"

namespace crepes {

/// Both triads of an IMU.
struct ImuTriads {
  TriadEstimate accelerometer;
  TriadEstimate gyroscope;
};

/// A recording holds readings in the body's axes, with a correction in force. `found` is what they
/// still lack: v_true = M (v_B - bias). Returns the correction of the sensor that takes the place
/// of the one in force and leaves nothing; sigmas as of independent errors.
[[nodiscard]] ImuTriads of_sensor(const ImuTriads& found, const ImuDeviceConfig& in_force);

/// The section `name` of `imu`, indented.
[[nodiscard]] std::string triad_text(std::string_view name, const TriadEstimate& triad);

}  // namespace crepes
