#include "drivers/uwb/range_line.hpp"

#include <optional>
#include <vector>

#include "drivers/base/number_text.hpp"
#include "drivers/serial/text_line.hpp"

namespace crepes {
namespace {

std::optional<UwbDistance> distance_in(std::string_view line) {
  const std::vector<std::string_view> words = parts_of(line, ' ');
  if ((words.size() != 3 && words.size() != 5) || words[0] != "range") return std::nullopt;
  UwbDistance distance;
  if (!parse_number(words[1], distance.module).empty()) return std::nullopt;
  if (!parse_number(words[2], distance.range_m).empty()) return std::nullopt;
  if (words.size() == 3) return distance;
  if (!parse_number(words[3], distance.first_path_dbm).empty()) return std::nullopt;
  if (!parse_number(words[4], distance.received_dbm).empty()) return std::nullopt;
  return distance;
}

}  // namespace

FrameCheck RangeLine::examine(Bytes bytes) {
  if (bytes[0] == '#') return examine_line(bytes, "#", kMaxFrame, [](auto) { return true; });
  return examine_line(bytes, "range ", kMaxFrame,
                      [](std::string_view line) { return distance_in(line).has_value(); });
}

UwbReading RangeLine::read(Bytes frame) {
  const std::optional<UwbDistance> distance = distance_in(line_in(frame));
  if (!distance) return {.no_ranges = "a comment"};
  return {.distances = {*distance}};
}

}  // namespace crepes
