#include "daemon/ctl/led_report.hpp"

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
    version += (version.empty() ? "" : ".") + std::to_string(part);
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
  std::string text = "id " + std::to_string(settings.robot_id) + ": ";
  text += is_duty_coded(settings) ? "lit " + ms(lit_ms) + " of " + ms(period_ms(settings))
                                  : "pattern " + pattern_of(settings) + ", slots of " + ms(lit_ms);
  text += "\nbrightness";
  for (const std::uint8_t percent : std::span(settings.brightness))
    text += " " + std::to_string(percent);
  return text + " %\n";
}

}  // namespace

std::string board_text(const led_settings& settings, const led_status& status) {
  return text_of(settings) + "firmware " + version_of(status) +
         ", clock: " + std::string(clock_of(status)) + ", " + std::to_string(status.skipped) +
         " bytes skipped" + (status.was_watchdog != 0 ? ", restarted by its watchdog\n" : "\n");
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
