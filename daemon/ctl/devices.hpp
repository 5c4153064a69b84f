/// crepesctl devices: what is plugged in, and what to write into the configuration for it.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

struct DevicesOptions {
  std::filesystem::path dev = "/dev";     ///< where serial ports and video devices are
  std::chrono::milliseconds listen{300};  ///< to a serial port, at each rate
  bool json = false;
};

/// Looks for cameras on USB and network and listens to every serial port that has a steady name.
[[nodiscard]] Result<std::string> list_devices(const DevicesOptions& options);

}  // namespace crepes
