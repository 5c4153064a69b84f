/// Bytes for devices that must be asked.
#pragma once

#include <string_view>

#include "drivers/serial/frame_decoder.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

struct DeviceRequest {
  std::string_view bytes;
  Duration pause{};            ///< until the next request
  bool only_if_silent = true;  ///< not while frames arrive
};

[[nodiscard]] inline Bytes bytes_of_text(std::string_view text) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): characters as bytes
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace crepes
