#include "drivers/uwb/mauwb.hpp"

#include <optional>
#include <vector>

#include "drivers/base/number_text.hpp"
#include "drivers/serial/text_line.hpp"

namespace crepes {
namespace {

/// The numbers in the brackets after `name`; empty if one of them is none.
std::vector<int> list_in(std::string_view line, std::string_view name) {
  std::vector<int> numbers;
  for (const std::string_view part : parts_of(between(line, name, ")"), ',')) {
    int number = 0;
    if (!parse_number(part, number).empty()) return {};
    numbers.push_back(number);
  }
  return numbers;
}

std::optional<std::vector<UwbDistance>> distances_in(std::string_view line) {
  std::uint32_t tag = 0;
  if (!parse_number(between(line, "tid:", ","), tag).empty()) return std::nullopt;
  const std::vector<int> ranges_cm = list_in(line, ",range:(");
  const bool has_ids = line.find(",ancid:(") != std::string_view::npos;
  const std::vector<int> ids = list_in(line, ",ancid:(");
  if (ranges_cm.empty() || !line.ends_with(')')) return std::nullopt;
  if (has_ids && ids.size() != ranges_cm.size()) return std::nullopt;
  std::vector<UwbDistance> distances;
  for (std::size_t i = 0; i < ranges_cm.size(); ++i) {
    const int id = has_ids ? ids[i] : static_cast<int>(i);
    if (id < 0 || ranges_cm[i] == 0) continue;
    distances.push_back(
        {.module = static_cast<std::uint32_t>(id), .range_m = ranges_cm[i] * 1e-2, .from = tag});
  }
  return distances;
}

}  // namespace

FrameCheck MaUwb::examine(Bytes bytes) {
  return examine_line(bytes, "AT+RANGE=", kMaxFrame,
                      [](std::string_view line) { return distances_in(line).has_value(); });
}

UwbReading MaUwb::read(Bytes frame) {
  return {.distances = distances_in(line_in(frame)).value_or(std::vector<UwbDistance>{})};
}

}  // namespace crepes
