/// Finds the IIO devices of the machine that measure motion.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/iio/iio_attributes.hpp"

namespace crepes {

/// Where the kernel shows its devices.
struct IioPaths {
  std::filesystem::path devices = "/sys/bus/iio/devices";
  std::filesystem::path dev = "/dev";
};

/// A device of the kernel in sysfs.
struct IioDevice {
  std::string id;     ///< as in "iio:device0"
  std::string name;   ///< of the chip, as in "icm42688-gyro"
  std::string label;  ///< of this one, from the device tree; may be empty
  IioAttributes attributes;
  bool measures_rate = false;
  bool measures_acceleration = false;

  /// With its name, for messages.
  [[nodiscard]] std::string title() const { return id + " (" + name + ")"; }
};

/// All that measure rate or acceleration, by id.
[[nodiscard]] std::vector<IioDevice> find_iio_devices(const IioPaths& paths);

/// The name of the chip, without the suffix of its gyroscope or accelerometer.
[[nodiscard]] std::string_view chip_of(std::string_view name);

/// The devices of an IMU; both may be the same.
struct IioImuDevices {
  IioDevice gyro;
  IioDevice accelerometer;
};

/// The only gyroscope and the only accelerometer that `port` names: beginnings of names, labels or
/// ids, with spaces or commas between them. Empty: all. Of several accelerometers, the gyroscope's
/// own is taken. kNotFound: there is none now.
[[nodiscard]] Result<IioImuDevices> choose_iio_imu(const IioPaths& paths, std::string_view port);

/// The devices of one inertial sensor.
struct FoundIioImu {
  std::string port;  ///< what names it, for `choose_iio_imu`
  IioImuDevices devices;
};

/// The IMUs of the machine, by the gyroscope's id.
[[nodiscard]] std::vector<FoundIioImu> find_iio_imus(const IioPaths& paths);

}  // namespace crepes
