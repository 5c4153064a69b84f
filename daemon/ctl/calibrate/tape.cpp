#include "daemon/ctl/calibrate/tape.hpp"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/base/number_text.hpp"
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
  const int line = std::max(node.Mark().line, 0);  // an empty file has none
  throw TapeFault{line + 1, fmt::format("{}: {}", key, reason)};
}

YAML::Node item_of(const YAML::Node& parent, const char* key) {
  if (!parent.IsMap()) refuse(parent, key, "is missing: this is not a mapping");
  const YAML::Node node = parent[key];
  if (!node) refuse(parent, key, "is missing");
  return node;
}

YAML::Node list_of(const YAML::Node& parent, const char* key) {
  const YAML::Node node = item_of(parent, key);
  if (!node.IsSequence()) refuse(node, key, "must be a list");
  if (node.size() == 0) refuse(node, key, "is an empty list");
  return node;
}

double number_of(const YAML::Node& node, const char* key, double min, double max) {
  double value = 0.0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value))
    refuse(node, key, "must be a number");
  if (value < min || value > max) refuse(node, key, fmt::format("outside [{}, {}]", min, max));
  return value;
}

RobotId id_of(const YAML::Node& node, const char* key) {
  const double id = number_of(node, key, 1.0, kLastTapedId);
  if (id != std::floor(id)) refuse(node, key, "must be a whole number");
  return RobotId{static_cast<std::uint16_t>(id)};
}

constexpr double kLeastDistance_m = 0.05;

TapedPair pair_of(const YAML::Node& node) {
  const YAML::Node ids = list_of(node, "ids");
  if (ids.size() != 2) refuse(ids, "ids", "must be two robots");
  RobotId a = id_of(ids[0], "ids");
  RobotId b = id_of(ids[1], "ids");
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
  if (const YAML::Node turning = node["turning"]; turning) {
    segment.turning = id_of(turning, "turning");
    const bool is_there = std::ranges::any_of(segment.pairs, [&](const TapedPair& pair) {
      return pair.pair.a == segment.turning || pair.pair.b == segment.turning;
    });
    if (!is_there) refuse(turning, "turning", "is a robot of none of the segment's pairs");
  }
  return segment;
}

std::optional<RobotId> robot_of(const std::string& word,
                                const std::map<std::string, RobotId>& names) {
  if (const auto named = names.find(word); named != names.end()) return named->second;
  int id = 0;
  if (!parse_number(word, id).empty() || id < 1 || id > static_cast<int>(kLastTapedId))
    return std::nullopt;
  return RobotId{static_cast<std::uint16_t>(id)};
}

}  // namespace

Result<TapedPair> parse_distance(const std::string& text,
                                 const std::map<std::string, RobotId>& names) {
  const auto refused = [&text](std::string_view reason) {
    return fail(ErrorCode::kUsage,
                fmt::format("--distance: '{}' {}; for example r1,r2=5.00", text, reason));
  };
  const std::size_t comma = text.find(',');
  const std::size_t equals = text.find('=');
  if (comma == std::string::npos || equals == std::string::npos || equals < comma)
    return refused("is not ROBOT,ROBOT=METERS");
  auto a = robot_of(text.substr(0, comma), names);
  auto b = robot_of(text.substr(comma + 1, equals - comma - 1), names);
  if (!a || !b || *a == *b) return refused("does not name two robots of the recording");
  if (*b < *a) std::swap(a, b);
  TapedPair pair{.pair = {*a, *b}};
  if (!parse_number(text.substr(equals + 1), pair.distance_m).empty() ||
      !(pair.distance_m >= kLeastDistance_m && pair.distance_m <= kMaxDistance_m))
    return refused("has no distance in meters");
  return pair;
}

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
