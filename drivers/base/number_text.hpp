/// Numbers to text and back, independent of the locale.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>

namespace crepes {

/// Appends the shortest text that reads back to the same bits.
template <class Number>
void append_number(std::string& text, Number value) {
  std::array<char, 32> buffer{};
  const auto [end, status] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  text.append(buffer.data(), end);
}

/// Reads `text` as a number, all of it; else leaves `value` as it was. A double must be finite.
/// Returns what is wrong, or nothing.
template <class Number>
[[nodiscard]] std::string_view parse_number(std::string_view text, Number& value) {
  Number parsed{};
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, parsed);
  if (status == std::errc::result_out_of_range) return "number out of range";
  if (status != std::errc{} || stop != end) return "not a number";
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(parsed)) return "not finite";
  }
  value = parsed;
  return {};
}

}  // namespace crepes
