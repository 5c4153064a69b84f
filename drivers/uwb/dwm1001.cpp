#include "drivers/uwb/dwm1001.hpp"

#include <array>
#include <charconv>
#include <chrono>
#include <optional>
#include <vector>

#include "drivers/base/number_text.hpp"
#include "drivers/serial/byte_fields.hpp"
#include "drivers/serial/text_line.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;
using Distances = std::vector<UwbDistance>;

/// Four hexadecimal digits.
std::optional<std::uint32_t> id_in(std::string_view digits) {
  constexpr int kHex = 16;
  std::uint32_t id = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stop, status] = std::from_chars(digits.data(), end, id, kHex);
  if (digits.size() != 4 || status != std::errc{} || stop != end) return std::nullopt;
  return id;
}

/// Adds the distance to a module; false if either is no number.
bool add(Distances& distances, std::string_view id, std::string_view metres) {
  const std::optional<std::uint32_t> module = id_in(id);
  UwbDistance distance;
  if (!module || !parse_number(metres, distance.range_m).empty()) return false;
  distance.module = *module;
  distances.push_back(distance);
  return true;
}

/// Whether these are `count` numbers.
bool are_numbers(const std::vector<std::string_view>& parts, std::size_t first, std::size_t count) {
  double number = 0.0;
  for (std::size_t i = first; i < first + count; ++i)
    if (!parse_number(parts[i], number).empty()) return false;
  return true;
}

/// DIST,n, then n times AN<i>,id,x,y,z,distance, then perhaps POS,x,y,z,quality.
std::optional<Distances> lec_distances(std::string_view line) {
  constexpr std::size_t kFirst = 2;
  constexpr std::size_t kAnchor = 6;
  constexpr std::size_t kPosition = 5;
  constexpr std::size_t kMostAnchors = 16;
  const std::vector<std::string_view> parts = parts_of(line, ',');
  std::size_t count = 0;
  if (parts.size() < kFirst || !parse_number(parts[1], count).empty() || count > kMostAnchors)
    return std::nullopt;
  const std::size_t end = kFirst + count * kAnchor;
  if (parts.size() != end && parts.size() != end + kPosition) return std::nullopt;
  Distances distances;
  for (std::size_t at = kFirst; at < end; at += kAnchor) {
    if (!parts[at].starts_with("AN") || !are_numbers(parts, at + 2, 3) ||
        !add(distances, parts[at + 1], parts[at + 5]))
      return std::nullopt;
  }
  const bool has_position = parts.size() != end;
  if (has_position && (parts[end] != "POS" || !are_numbers(parts, end + 1, kPosition - 1)))
    return std::nullopt;
  return distances;
}

/// id[x,y,z]=distance, separated by blanks, then le_us=time and perhaps est[x,y,z,quality].
std::optional<Distances> les_distances(std::string_view line) {
  constexpr std::size_t kIdLength = 4;
  Distances distances;
  bool ends = false;
  for (const std::string_view word : parts_of(line, ' ')) {
    ends = ends || word.starts_with("le_us=");
    if (ends) continue;
    const std::size_t equals = word.find("]=");
    if (equals == std::string_view::npos || word.size() < kIdLength + 1 || word[kIdLength] != '[')
      return std::nullopt;
    const std::vector<std::string_view> place =
        parts_of(word.substr(kIdLength + 1, equals - kIdLength - 1), ',');
    if (place.size() != 3 || !are_numbers(place, 0, 3)) return std::nullopt;
    if (!add(distances, word.substr(0, kIdLength), word.substr(equals + 2))) return std::nullopt;
  }
  if (!ends || distances.empty()) return std::nullopt;
  return distances;
}

std::optional<Distances> shell_distances(std::string_view line) {
  return line.starts_with("DIST") ? lec_distances(line) : les_distances(line);
}

/// Whether the line may still be one of `les`: it begins with an id and a bracket.
bool may_begin_les(Bytes bytes) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  for (std::size_t i = 0; i < std::min<std::size_t>(bytes.size(), 4); ++i)
    if (kDigits.find(static_cast<char>(bytes[i])) == std::string_view::npos) return false;
  return bytes.size() < 5 || bytes[4] == '[';
}

constexpr std::array<std::uint8_t, 5> kLocationBegins{0x40, 0x01, 0x00, 0x41, 0x0d};
constexpr std::size_t kTlvType = 18;
constexpr std::size_t kTlvCount = 20;
constexpr std::size_t kTlvFirst = 21;
constexpr std::uint8_t kOfAnchor = 0x48;
constexpr std::uint8_t kOfTag = 0x49;

struct TlvEntry {
  std::size_t size;
  std::size_t id_size;
};

TlvEntry entry_of(std::uint8_t type) { return type == kOfTag ? TlvEntry{20, 2} : TlvEntry{13, 8}; }

}  // namespace

FrameCheck Dwm1001Shell::examine(Bytes bytes) {
  const auto is_valid = [](std::string_view line) { return shell_distances(line).has_value(); };
  if (bytes[0] == 'D' && (bytes.size() < 2 || bytes[1] == 'I'))
    return examine_line(bytes, "DIST,", kMaxFrame, is_valid);
  if (!may_begin_les(bytes)) return {};
  return examine_line(bytes, "", kMaxFrame, is_valid);
}

UwbReading Dwm1001Shell::read(Bytes frame) {
  return {.distances = shell_distances(line_in(frame)).value_or(Distances{})};
}

DeviceRequest Dwm1001Shell::request(std::size_t number) {
  return {.bytes = number % 2 == 0 ? "\r\r" : "lec\r", .pause = milliseconds{1000}};
}

FrameCheck Dwm1001Tlv::examine(Bytes bytes) {
  const std::size_t known = std::min(bytes.size(), kLocationBegins.size());
  if (!std::ranges::equal(bytes.first(known), std::span(kLocationBegins).first(known))) return {};
  if (bytes.size() <= kTlvCount) return {FrameKind::kIncomplete};
  if (bytes[kTlvType] != kOfAnchor && bytes[kTlvType] != kOfTag) return {};
  const std::size_t content = 1 + bytes[kTlvCount] * entry_of(bytes[kTlvType]).size;
  if (bytes[kTlvType + 1] != content) return {};
  const std::size_t length = kTlvCount + content;
  if (bytes.size() < length) return {FrameKind::kIncomplete};
  if (begins_twice(bytes.first(length))) return {};  // cut short, and the next one behind it
  return {FrameKind::kComplete, length};
}

UwbReading Dwm1001Tlv::read(Bytes frame) {
  const TlvEntry entry = entry_of(frame[kTlvType]);
  UwbReading reading;
  for (std::size_t at = kTlvFirst; at < frame.size(); at += entry.size) {
    // The short address is the last 16 bits of an id.
    reading.distances.push_back(
        {.module = static_cast<std::uint32_t>(unsigned_at(frame, at, 2)),
         .range_m = static_cast<double>(unsigned_at(frame, at + entry.id_size, 4)) * 1e-3});
  }
  return reading;
}

DeviceRequest Dwm1001Tlv::request(std::size_t /*number*/) {
  constexpr std::string_view kLocGet("\x0c\x00", 2);
  return {.bytes = kLocGet, .pause = milliseconds{100}, .only_if_silent = false};
}

}  // namespace crepes
