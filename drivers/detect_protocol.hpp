/// Detects the protocol of a serial device from its bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/serial/frame_decoder.hpp"

namespace crepes {

/// What a serial device sends.
enum class SerialProtocol : std::uint8_t {
  kNlink,
  kDwm1001Shell,
  kDwm1001Tlv,
  kMaUwb,
  kFiraUci,
  kBu03,
  kRangeLine,
  kWitMotion,
  kHipnuc,
  kXsens,
  kMavlink,
  kVectorNav,
  kMicroStrain,
  kWitMotionBle
};

/// The name in the configuration; for NLink, the name of the product.
[[nodiscard]] std::string_view name_of(SerialProtocol protocol);

/// Whether a ranging module speaks it, not an inertial sensor.
[[nodiscard]] bool is_of_uwb(SerialProtocol protocol);

/// The protocol of which at least three frames fill at least a quarter of `recent`; autopilots send
/// many messages that are unknown here. Empty if there is none. `recent` may begin and end within a
/// frame.
[[nodiscard]] std::optional<SerialProtocol> detect_protocol(Bytes recent);

}  // namespace crepes
