/// crepesctl devices: lists connected devices and their configuration lines.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

struct DevicesOptions {
  std::filesystem::path dev = "/dev";     ///< the folder of serial ports and video devices
  std::chrono::milliseconds listen{300};  ///< time to listen to a serial port at each rate
  bool json = false;
};

/// Searches cameras on USB and network, and listens to every serial port with a persistent name.
[[nodiscard]] Result<std::string> list_devices(const DevicesOptions& options);

}  // namespace crepes
