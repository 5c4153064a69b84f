/// Frames that are lines of text.
#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "drivers/serial/frame_decoder.hpp"

namespace crepes {

[[nodiscard]] inline std::string_view text_of(Bytes bytes) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as characters
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// The line without its end, "\n" or "\r\n".
[[nodiscard]] inline std::string_view line_in(Bytes frame) {
  std::string_view line = text_of(frame);
  if (line.ends_with('\n')) line.remove_suffix(1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

/// Whether `bytes` begin with `prefix`, printable characters and the end of a line, of which
/// `is_valid` holds; at most `most` bytes.
template <class IsValid>
[[nodiscard]] FrameCheck examine_line(Bytes bytes, std::string_view prefix, std::size_t most,
                                      const IsValid& is_valid) {
  const std::string_view text = text_of(bytes.first(std::min(bytes.size(), most)));
  const std::size_t known = std::min(text.size(), prefix.size());
  if (text.substr(0, known) != prefix.substr(0, known)) return {};
  const std::size_t end = std::min(
      static_cast<std::size_t>(
          std::ranges::find_if(text, [](char c) { return c < ' ' || c > '~'; }) - text.begin()),
      text.size());
  const std::string_view rest = text.substr(end);
  if (rest.empty() || rest == "\r")
    return text.size() < most ? FrameCheck{FrameKind::kIncomplete} : FrameCheck{};
  if (!rest.starts_with('\n') && !rest.starts_with("\r\n")) return {};
  if (!is_valid(text.substr(0, end))) return {};
  return {FrameKind::kComplete, end + (rest[0] == '\n' ? 1 : 2)};
}

/// The parts between separators, empty ones too.
[[nodiscard]] inline std::vector<std::string_view> parts_of(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    parts.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

/// What stands between `before` and `after`; empty if they are not there.
[[nodiscard]] inline std::string_view between(std::string_view text, std::string_view before,
                                              std::string_view after) {
  const std::size_t begin = text.find(before);
  if (begin == std::string_view::npos) return {};
  const std::size_t from = begin + before.size();
  const std::size_t end = text.find(after, from);
  return end == std::string_view::npos ? std::string_view{} : text.substr(from, end - from);
}

}  // namespace crepes
