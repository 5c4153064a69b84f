#include "daemon/ctl/setup/led.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/setup/led_report.hpp"
#include "daemon/ctl/setup/swarm_members.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/led_board/led_line.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes {
namespace {

Result<std::uint16_t> ticks_of(const std::string& key, double ms) {
  const double ticks = std::round(ms * kTicksPerMs);
  if (std::abs(ms * kTicksPerMs - ticks) > 1e-6) {
    return fail(ErrorCode::kConfig,
                fmt::format("{}: must be a multiple of 0.1 ms, is {}", key, fixed(ms, 4)));
  }
  return static_cast<std::uint16_t>(ticks);
}

led_settings with_pattern(led_settings settings, std::string_view pattern, std::uint16_t slot) {
  settings.slots = static_cast<std::uint8_t>(pattern.size());
  for (std::size_t i = 0; i < pattern.size(); ++i)
    if (pattern[i] == '1') settings.pattern |= std::uint32_t{1} << i;
  settings.lit_ticks = settings.dark_ticks = slot;
  return settings;
}

/// Rounds the end of the lit part to the nearest tick.
led_settings with_duty(led_settings settings, double duty, std::uint16_t period) {
  settings.slots = 2;
  settings.pattern = 1;
  settings.lit_ticks = static_cast<std::uint16_t>(std::lround(duty * period));
  settings.dark_ticks = static_cast<std::uint16_t>(period - settings.lit_ticks);
  return settings;
}

/// The settings and the status of the board.
Result<std::string> report_of(LedLine& line, bool json) {
  const Result<led_settings> settings = line.settings();
  if (!settings) return tl::unexpected(settings.error());
  return line.status().map([&](const led_status& status) {
    return json ? board_json(*settings, status) : board_text(*settings, status);
  });
}

}  // namespace

Result<led_settings> led_settings_of(const SwarmConfig& swarm, RobotId id,
                                     const std::vector<int>& brightness) {
  if (brightness.size() != 1 && brightness.size() != LED_COUNT)
    return fail(ErrorCode::kUsage, "brightness: one for all LEDs, or one for each of six");
  const auto member = std::ranges::find(swarm.members, id, &MemberConfig::id);
  if (member == swarm.members.end())
    return fail(ErrorCode::kNotFound, fmt::format("swarm.members: none has id {}", id.value));
  if (const Result<BlinkCode> code = BlinkCode::from(*member, swarm); !code)
    return tl::unexpected(Error{code.error()}.with_context(fmt::format("id {}", id.value)));
  led_settings settings{};
  settings.robot_id = id.value;
  for (std::size_t i = 0; i < LED_COUNT; ++i) {
    const int percent = std::clamp(brightness[i % brightness.size()], 0, 255);
    settings.brightness[i] = static_cast<std::uint8_t>(percent);
  }
  const auto whole =
      member->pattern ? ticks_of("swarm.slot_ms", swarm.slot_ms).map([&](std::uint16_t slot) {
        return with_pattern(settings, *member->pattern, slot);
      })
                      : ticks_of("swarm.period_ms", swarm.period_ms).map([&](std::uint16_t period) {
                          return with_duty(settings, *member->duty, period);
                        });
  if (!whole) return tl::unexpected(whole.error());
  const led_fault fault = led_settings_fault(&*whole);
  if (fault != LED_FINE) return fail(ErrorCode::kConfig, describe(fault));
  return *whole;
}

Result<std::string> led_set(const LedOptions& options) {
  const MonotonicClock clock;
  const auto settings = load_members(options.library).and_then([&](const SwarmConfig& swarm) {
    return led_settings_of(swarm, RobotId{static_cast<std::uint16_t>(options.id)},
                           options.brightness)
        .map_error(
            [&](Error error) { return std::move(error).with_context(options.library.string()); });
  });
  if (!settings) return tl::unexpected(settings.error());
  Result<LedLine> line = LedLine::open(options.port, clock);
  if (!line) return tl::unexpected(line.error());
  return line->set(*settings).and_then([&] { return report_of(*line, options.json); });
}

Result<std::string> led_get(const LedOptions& options) {
  const MonotonicClock clock;
  Result<LedLine> line = LedLine::open(options.port, clock);
  return line.and_then([&](LedLine& open) { return report_of(open, options.json); });
}

Result<std::string> led_test(const LedOptions& options) {
  const MonotonicClock clock;
  Result<LedLine> line = LedLine::open(options.port, clock);
  if (!line) return tl::unexpected(line.error());
  const auto ms = std::chrono::milliseconds(std::llround(options.test_s * 1e3));
  return line->test(ms).map([&] {
    return options.json ? json_line({{"lit_s", options.test_s}})
                        : fmt::format("lit for {} s\n", fixed(options.test_s, 1));
  });
}

}  // namespace crepes
