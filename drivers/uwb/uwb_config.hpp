/// Settings: the ranging module.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "estimator/core/sensor_noise.hpp"
#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// What a ranging module sends.
enum class UwbProtocol : std::uint8_t {
  kAuto,
  kLinkTrack,
  kDwm1001Shell,
  kDwm1001Tlv,
  kMaUwb,
  kFiraUci,
  kBu03,
  kRangeLine
};
inline constexpr std::array kUwbProtocols{Choice{"auto", UwbProtocol::kAuto},
                                          Choice{"linktrack", UwbProtocol::kLinkTrack},
                                          Choice{"dwm1001", UwbProtocol::kDwm1001Shell},
                                          Choice{"dwm1001_tlv", UwbProtocol::kDwm1001Tlv},
                                          Choice{"mauwb", UwbProtocol::kMaUwb},
                                          Choice{"fira", UwbProtocol::kFiraUci},
                                          Choice{"bu03", UwbProtocol::kBu03},
                                          Choice{"lines", UwbProtocol::kRangeLine}};

/// The serial line.
struct UwbDeviceConfig {
  std::string port;
  int baud = 921600;
  UwbProtocol protocol = UwbProtocol::kAuto;

  [[nodiscard]] bool operator==(const UwbDeviceConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("port", port, "serial device, best under /dev/serial/by-id");
    v.field("baud", baud, Bounds{1200, 4000000}, "bits per second");
    v.choice("protocol", protocol, kUwbProtocols,
             "protocol of the module; auto: detect it, once it talks");
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
