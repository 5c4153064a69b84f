#include "daemon/ctl/calibrate/tape.hpp"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "drivers/base/text_file.hpp"

namespace crepes {
namespace {

constexpr double kLongestRecording_s = 1e6;
constexpr double kMaxDistance_m = 1000.0;
constexpr double kLastTapedId = 65534.0;

/// Thrown and caught in this file only, beside yaml-cpp's own exceptions.
struct TapeFault {
  int line;
  std::string message;
};

[[noreturn]] void refuse(const YAML::Node& node, std::string_view key, std::string_view reason) {
  throw TapeFault{node.Mark().line + 1, fmt::format("{}: {}", key, reason)};
}

YAML::Node item_of(const YAML::Node& parent, const char* key) {
  if (!parent.IsMap()) refuse(parent, key, "is missing: this is not a mapping");
  const YAML::Node node = parent[key];
  if (!node) refuse(parent, key, "is missing");
  return node;
}

YAML::Node list_of(const YAML::Node& parent, const char* key) {
  const YAML::Node node = item_of(parent, key);
  if (!node.IsSequence() || node.size() == 0) refuse(node, key, "must be a list");
  return node;
}

double number_of(const YAML::Node& node, const char* key, double min, double max) {
  double value = 0.0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value))
    refuse(node, key, "must be a number");
  if (value < min || value > max) refuse(node, key, fmt::format("outside [{}, {}]", min, max));
  return value;
}

RobotId id_of(const YAML::Node& node) {
  const double id = number_of(node, "ids", 1.0, kLastTapedId);
  if (id != std::floor(id)) refuse(node, "ids", "must be whole numbers");
  return RobotId{static_cast<std::uint16_t>(id)};
}

TapedPair pair_of(const YAML::Node& node) {
  constexpr double kLeastDistance_m = 0.05;
  const YAML::Node ids = list_of(node, "ids");
  if (ids.size() != 2) refuse(ids, "ids", "must be two robots");
  RobotId a = id_of(ids[0]);
  RobotId b = id_of(ids[1]);
  if (a == b) refuse(ids, "ids", "must be two robots");
  if (b < a) std::swap(a, b);
  return {{a, b},
          number_of(item_of(node, "distance_m"), "distance_m", kLeastDistance_m, kMaxDistance_m)};
}

TapeSegment segment_of(const YAML::Node& node) {
  TapeSegment segment;
  segment.from_s = number_of(item_of(node, "from_s"), "from_s", 0.0, kLongestRecording_s);
  segment.to_s = number_of(item_of(node, "to_s"), "to_s", 0.0, kLongestRecording_s);
  if (!(segment.to_s > segment.from_s)) refuse(node, "to_s", "must be after from_s");
  for (const YAML::Node& pair : list_of(node, "pairs")) segment.pairs.push_back(pair_of(pair));
  return segment;
}

}  // namespace

Result<std::vector<TapeSegment>> load_tape(const std::filesystem::path& file) {
  const auto fault = [&file](int line, const std::string& message) {
    return fail(ErrorCode::kFormat, fmt::format("{}:{}: {}", file.string(), line, message));
  };
  const Result<std::string> text = read_text_file(file, kMaxConfigBytes);
  if (!text) return tl::unexpected(text.error());
  try {
    std::vector<TapeSegment> segments;
    for (const YAML::Node& node : list_of(YAML::Load(*text), "segments"))
      segments.push_back(segment_of(node));
    return segments;
  } catch (const TapeFault& e) {
    return fault(e.line, e.message);
  } catch (const YAML::Exception& e) {
    return fault(e.mark.line + 1, e.msg);
  }
}

}  // namespace crepes
