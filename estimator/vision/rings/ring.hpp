/// A board whose LEDs are separate lights.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "estimator/vision/ring_model.hpp"

namespace crepes {

/// A board whose LEDs are separate lights.
struct Ring {
  RingView view{};
  int leds = 0;  ///< of the board; some may be hidden
  std::array<std::uint32_t, kMaxRingLeds> lights{};
  std::size_t count = 0;  ///< of lights
  double rms = 0.0;       ///< [px]

  [[nodiscard]] bool is_whole() const { return count == static_cast<std::size_t>(leds); }
  [[nodiscard]] std::span<const std::uint32_t> members() const {
    return std::span(lights).first(count);
  }
};

/// So few lights are weak evidence of a ring.
inline constexpr std::size_t kFewLights = 4;

}  // namespace crepes
