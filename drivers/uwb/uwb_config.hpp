/// Settings: the ranging module.
#pragma once

#include <string>

#include "estimator/core/sensor_noise.hpp"
#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// The serial line.
struct UwbDeviceConfig {
  std::string port;
  int baud = 921600;

  [[nodiscard]] bool operator==(const UwbDeviceConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("port", port, "serial device, best under /dev/serial/by-id");
    v.field("baud", baud, Bounds{1200, 4000000}, "bits per second");
  }
};

struct UwbConfig {
  RangeNoise noise;
  UwbDeviceConfig device;

  [[nodiscard]] bool operator==(const UwbConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    noise.visit(v);
    device.visit(v);
  }
};

}  // namespace crepes
