/// The settings and status of an LED board as text and JSON.
#pragma once

#include <string>

#include "firmware/protocol/led_messages.h"

namespace crepes {

inline constexpr double kTicksPerMs = 1000.0 / int{LED_TICK_US};

[[nodiscard]] std::string board_text(const led_settings& settings, const led_status& status);

/// For a board that was never programmed, `id` and its pattern are omitted.
[[nodiscard]] std::string board_json(const led_settings& settings, const led_status& status);

}  // namespace crepes
