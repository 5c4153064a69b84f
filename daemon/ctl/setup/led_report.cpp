#include "daemon/ctl/setup/led_report.hpp"

#include <fmt/core.h>

#include <array>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

bool is_duty_coded(const led_settings& settings) { return settings.slots == 2; }

double period_ms(const led_settings& settings) {
  return (settings.lit_ticks + settings.dark_ticks) / kTicksPerMs;
}

std::string pattern_of(const led_settings& settings) {
  std::string pattern;
  for (int i = 0; i < settings.slots; ++i) pattern += (settings.pattern >> i & 1U) != 0 ? '1' : '0';
  return pattern;
}

std::string version_of(const led_status& status) {
  std::string version;
  for (const std::uint8_t part : std::span(status.version))
    version += fmt::format("{}{}", version.empty() ? "" : ".", part);
  return version;
}

std::string_view clock_of(const led_status& status) {
  constexpr std::array<std::string_view, 3> kClocks{
      "crystal", "internal oscillator: the crystal does not start",
      "internal oscillator without PLL: the crystal does not start"};
  return status.clock < kClocks.size() ? kClocks.at(status.clock) : "unknown";
}

std::string text_of(const led_settings& settings) {
  if (settings.robot_id == 0) return "never set: dark\n";
  const auto ms = [](double value) { return fixed(value, 1) + " ms"; };
  const double lit_ms = settings.lit_ticks / kTicksPerMs;
  const std::string code =
      is_duty_coded(settings)
          ? fmt::format("lit {} of {}", ms(lit_ms), ms(period_ms(settings)))
          : fmt::format("pattern {}, slots of {}", pattern_of(settings), ms(lit_ms));
  std::string text = fmt::format("id {}: {}\nbrightness", settings.robot_id, code);
  for (const std::uint8_t percent : std::span(settings.brightness))
    text += fmt::format(" {}", percent);
  return text + " %\n";
}

}  // namespace

std::string board_text(const led_settings& settings, const led_status& status) {
  return fmt::format("{}firmware {}, clock: {}, {} bytes skipped{}\n", text_of(settings),
                     version_of(status), clock_of(status), status.skipped,
                     status.was_watchdog != 0 ? ", restarted by its watchdog" : "");
}

std::string board_json(const led_settings& settings, const led_status& status) {
  Json json = Json::object();
  if (settings.robot_id != 0) {
    json["id"] = settings.robot_id;
    if (is_duty_coded(settings)) {
      json["lit_ms"] = settings.lit_ticks / kTicksPerMs;
      json["period_ms"] = period_ms(settings);
    } else {
      json["pattern"] = pattern_of(settings);
      json["slot_ms"] = settings.lit_ticks / kTicksPerMs;
    }
    for (const std::uint8_t percent : std::span(settings.brightness))
      json["brightness"].push_back(percent);
  }
  json["firmware"] = version_of(status);
  json["clock"] = clock_of(status);
  json["skipped_bytes"] = status.skipped;
  json["restarted_by_watchdog"] = status.was_watchdog != 0;
  return json_line(json);
}

}  // namespace crepes
