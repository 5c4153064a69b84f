/// Numbers in the sentences of a refusal.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <string>

namespace crepes {

/// `value` with `decimals` decimals.
[[nodiscard]] inline std::string number_text(double value, int decimals) {
  std::array<char, 64> text{};
  if (!std::isfinite(value) || std::abs(value) > 1e30) return "?";
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 std::chars_format::fixed, decimals);
  return {text.data(), end.ptr};
}

}  // namespace crepes
