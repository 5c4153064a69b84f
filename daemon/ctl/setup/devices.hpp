/// crepesctl devices: lists connected devices and their configuration lines.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "drivers/detect_protocol.hpp"
#include "drivers/iio/iio_devices.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl devices`.
struct DevicesOptions {
  std::filesystem::path dev = "/dev";     ///< the folder of serial ports and video devices
  IioPaths iio{};                         ///< where the kernel shows its IMUs
  std::chrono::milliseconds listen{300};  ///< time to listen to a serial port at each rate
  bool json = false;
};

/// A serial port, and the protocol of its device.
struct SerialDevice {
  std::string port;
  int baud = 0;
  std::optional<SerialProtocol> speaks;
  std::string fault;  ///< why it could not be read
};

/// A camera that is connected.
struct CameraDevice {
  std::string driver;  ///< as in the configuration
  FoundCamera found;
};

/// All devices that were found.
struct ConnectedDevices {
  std::vector<CameraDevice> cameras;
  std::vector<SerialDevice> serial;  ///< by port
  std::vector<FoundIioImu> kernel_imus;
};

/// Searches cameras on USB and network and the kernel's IMUs, and listens to every serial port with
/// a persistent name.
[[nodiscard]] ConnectedDevices find_devices(const DevicesOptions& options);

/// The same as text, with the lines for the configuration, or as JSON.
[[nodiscard]] Result<std::string> list_devices(const DevicesOptions& options);

}  // namespace crepes
