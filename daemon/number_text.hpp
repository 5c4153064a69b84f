/// Numbers as text that reads back to the same bits.
#pragma once

#include <array>
#include <charconv>
#include <string>

namespace crepes {

/// Appends the shortest such text.
template <class Number>
void append_number(std::string& text, Number value) {
  std::array<char, 32> buffer{};
  const auto [end, status] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  text.append(buffer.data(), end);
}

}  // namespace crepes
