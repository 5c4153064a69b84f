/// What a LED board holds and how it is, for people and for programs.
#pragma once

#include <string>

#include "firmware/protocol/led_messages.h"

namespace crepes {

inline constexpr double kTicksPerMs = 1000.0 / int{LED_TICK_US};

[[nodiscard]] std::string board_text(const led_settings& settings, const led_status& status);

/// Of a board that was never set, `id` and what it would blink are left out.
[[nodiscard]] std::string board_json(const led_settings& settings, const led_status& status);

}  // namespace crepes
