#include "drivers/uwb/nlink.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

/// One kind of frame: a fixed part that ends with the number of nodes, the nodes, a checksum.
struct Layout {
  std::uint8_t function = 0;
  std::size_t system_time_at = 0;
  std::size_t fixed = 0;
  std::size_t per_node = 0;
  std::optional<std::size_t> node_time_at;

  [[nodiscard]] std::size_t length(std::size_t nodes) const { return fixed + nodes * per_node + 1; }
};

constexpr std::uint8_t kHeader = 0x55;
constexpr Layout kNodeFrame2{0x04, 6, 119, 13, 7};
constexpr Layout kNodeFrame3{0x05, 10, 21, 7, std::nullopt};
constexpr std::size_t kMostNodes = 255;
constexpr std::uint8_t kLastRole = 6;
constexpr double kOldestRangeMs = 1000.0;

const Layout* layout_of(std::uint8_t function) {
  if (function == kNodeFrame2.function) return &kNodeFrame2;
  if (function == kNodeFrame3.function) return &kNodeFrame3;
  return nullptr;
}

std::uint32_t unsigned_at(Bytes bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = count; i-- > 0;) value = value << 8U | bytes[at + i];
  return value;
}

std::int32_t int24_at(Bytes bytes, std::size_t at) {
  const auto value = static_cast<std::int32_t>(unsigned_at(bytes, at, 3));
  return value >= 0x800000 ? value - 0x1000000 : value;
}

std::uint8_t checksum_of(Bytes bytes) {
  return static_cast<std::uint8_t>(std::accumulate(bytes.begin(), bytes.end(), 0U));
}

void append(std::vector<std::uint8_t>& out, std::uint32_t value, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(static_cast<std::uint8_t>(value >> 8U * i & 0xffU));
  }
}

/// A frame cut short and the beginning of the next can have the right sum, but not the roles.
bool has_known_roles(Bytes frame, const Layout& layout) {
  for (std::size_t at = layout.fixed; at + 1 < frame.size(); at += layout.per_node) {
    if (frame[at] > kLastRole) return false;
  }
  return true;
}

std::uint32_t power_code(double dbm) {
  return static_cast<std::uint32_t>(std::clamp(std::lround(-2.0 * dbm), 0L, 255L));
}

}  // namespace

UwbModules uwb_modules_of(const SwarmConfig& swarm) {
  UwbModules modules;
  for (const MemberConfig& member : swarm.members) {
    modules.emplace(static_cast<std::uint32_t>(member.uwb_id.value_or(member.id.value)), member.id);
  }
  return modules;
}

FrameCheck NlinkParser::examine(Bytes bytes) {
  if (bytes[0] != kHeader && bytes[0] != 0xff) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (bytes[0] == 0xff) return {bytes[1] == 0x02 ? FrameKind::kForeign : FrameKind::kNone};
  const Layout* layout = layout_of(bytes[1]);
  if (layout == nullptr) return {};

  // The length stands twice, in itself and as the number of nodes: both must agree.
  if (bytes.size() < 4) return {FrameKind::kIncomplete};
  const std::size_t length = unsigned_at(bytes, 2, 2);
  if (length < layout->length(0) || length > layout->length(kMostNodes)) return {};
  if (bytes.size() < layout->fixed) return {FrameKind::kIncomplete};
  if (length != layout->length(bytes[layout->fixed - 1])) return {};
  if (bytes.size() < length) return {FrameKind::kIncomplete};
  if (checksum_of(bytes.first(length - 1)) != bytes[length - 1]) return {FrameKind::kBadChecksum};
  if (!has_known_roles(bytes.first(length), *layout)) return {};
  return {FrameKind::kComplete, length};
}

void NlinkParser::parse(Bytes frame, Timestamp arrival,
                        const std::function<void(const UwbRange&)>& sink) {
  const Layout* layout = layout_of(frame[1]);
  CREPES_EXPECT(layout != nullptr, "a whole frame of a known kind");
  const std::uint32_t system_time = unsigned_at(frame, layout->system_time_at, 4);
  for (std::size_t at = layout->fixed; at + 1 < frame.size(); at += layout->per_node) {
    const auto robot = modules_.find(frame[at + 1]);
    if (robot == modules_.end()) {
      ++counts_.unknown_modules;
      continue;
    }
    const double range_m = int24_at(frame, at + 2) / 1000.0;
    const double age_ms =
        layout->node_time_at ? system_time - unsigned_at(frame, at + *layout->node_time_at, 4) : 0U;
    if (range_m <= 0.0 || range_m > max_range_m_ || age_ms > kOldestRangeMs) {
      ++counts_.implausible;
      continue;
    }
    ++counts_.ranges;
    sink({.stamp = arrival - from_seconds(age_ms * 1e-3),
          .neighbor = robot->second,
          .range_m = range_m,
          .first_path_dbm = frame[at + 5] / -2.0,
          .received_dbm = frame[at + 6] / -2.0});
  }
}

std::vector<std::uint8_t> encode_node_frame3(std::uint8_t module, std::uint32_t system_time_ms,
                                             const std::vector<NlinkNode>& nodes) {
  constexpr std::uint8_t kRoleNode = 0;
  constexpr std::uint32_t kMillivolts = 4950;
  CREPES_EXPECT(nodes.size() <= kMostNodes, "the number of nodes is one byte");
  std::vector<std::uint8_t> out{kHeader, kNodeFrame3.function};
  append(out, static_cast<std::uint32_t>(kNodeFrame3.length(nodes.size())), 2);
  append(out, kRoleNode, 1);
  append(out, module, 1);
  append(out, system_time_ms, 4);  // the module's own time
  append(out, system_time_ms, 4);  // the network's time
  append(out, 0, 4);
  append(out, kMillivolts, 2);
  append(out, static_cast<std::uint32_t>(nodes.size()), 1);
  for (const NlinkNode& node : nodes) {
    append(out, kRoleNode, 1);
    append(out, node.module, 1);
    append(out, static_cast<std::uint32_t>(std::lround(node.range_m * 1000.0)), 3);
    append(out, power_code(node.first_path_dbm), 1);
    append(out, power_code(node.received_dbm), 1);
  }
  out.push_back(checksum_of(out));
  return out;
}

}  // namespace crepes
