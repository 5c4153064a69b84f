/// Settings of an LED board, as tests write and compare them.
#pragma once

#include <array>
#include <string_view>

#include "firmware/protocol/led_messages.h"

namespace crepes {

inline led_settings pattern_settings(std::uint16_t id, std::string_view pattern,
                                     std::uint16_t slot_ticks = 100) {
  led_settings settings{};
  settings.robot_id = id;
  settings.slots = static_cast<std::uint8_t>(pattern.size());
  for (std::size_t i = 0; i < pattern.size(); ++i)
    if (pattern[i] == '1') settings.pattern |= 1U << i;
  settings.lit_ticks = settings.dark_ticks = slot_ticks;
  for (std::uint8_t& brightness : settings.brightness) brightness = 100;
  return settings;
}

inline led_settings duty_settings(std::uint16_t id, std::uint16_t lit_ticks,
                                  std::uint16_t dark_ticks) {
  led_settings settings = pattern_settings(id, "10");
  settings.lit_ticks = lit_ticks;
  settings.dark_ticks = dark_ticks;
  return settings;
}

/// To be compared; says all that the settings say.
inline std::array<std::uint8_t, LED_SETTINGS_SIZE> bytes_of(const led_settings& settings) {
  std::array<std::uint8_t, LED_SETTINGS_SIZE> bytes{};
  led_settings_write(&settings, bytes.data());
  return bytes;
}

}  // namespace crepes
