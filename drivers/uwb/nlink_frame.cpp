#include "drivers/uwb/nlink_frame.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/serial/byte_fields.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr std::uint8_t kNlinkHeader = 0x55;
constexpr std::uint8_t kIotHeader = 0x6a;
constexpr std::uint8_t kLastRole = 6;
constexpr std::size_t kMostNodes = 255;

/// A kind with nodes: a fixed part that ends with the number of nodes, the nodes, a checksum.
/// Offsets are from the frame, or from the node where the name says so; 0: the kind has no such
/// field.
struct Layout {
  NlinkKind kind;
  std::string_view name;
  std::size_t id = 5;          ///< of the module
  std::size_t id_size = 1;     ///< of module ids
  std::size_t role = 4;        ///< of the module
  bool has_node_roles = true;  ///< before the nodes' ids
  std::size_t local_time = 0;
  std::size_t system_time = 0;
  std::size_t voltage = 0;
  std::size_t count = 0;
  std::size_t node_size = 0;  ///< with user data: of what precedes them
  std::size_t node_id = 1;
  std::size_t node_range = 0;
  std::size_t node_powers = 0;
  std::size_t node_time = 0;
  std::size_t node_angle = 0;
  std::size_t node_position = 0;
  std::size_t node_user_data = 0;       ///< their number
  std::size_t node_user_data_size = 2;  ///< of that number
  std::size_t node_user_data_unit = 1;  ///< bytes each

  [[nodiscard]] std::size_t first_node() const { return count + 1; }
};

constexpr std::array kLayouts{
    Layout{.kind = NlinkKind::kNodeFrame0,
           .name = "NodeFrame0",
           .count = 10,
           .node_size = 4,
           .node_user_data = 2},
    Layout{.kind = NlinkKind::kNodeFrame1,
           .name = "NodeFrame1",
           .local_time = 10,
           .system_time = 6,
           .voltage = 24,
           .count = 26,
           .node_size = 20,
           .node_position = 2},
    Layout{.kind = NlinkKind::kNodeFrame2,
           .name = "NodeFrame2",
           .local_time = 102,
           .system_time = 6,
           .voltage = 116,
           .count = 118,
           .node_size = 13,
           .node_range = 2,
           .node_powers = 5,
           .node_time = 7},
    Layout{.kind = NlinkKind::kNodeFrame3,
           .name = "NodeFrame3",
           .local_time = 6,
           .system_time = 10,
           .voltage = 18,
           .count = 20,
           .node_size = 7,
           .node_range = 2,
           .node_powers = 5},
    Layout{.kind = NlinkKind::kNodeFrame4,
           .name = "NodeFrame4",
           .has_node_roles = false,
           .local_time = 10,
           .system_time = 6,
           .voltage = 18,
           .count = 20,
           .node_size = 5,
           .node_id = 0,
           .node_user_data = 4,
           .node_user_data_size = 1,
           .node_user_data_unit = 4},
    Layout{.kind = NlinkKind::kAoaNodeFrame0,
           .name = "AOA NodeFrame0",
           .local_time = 6,
           .system_time = 10,
           .voltage = 18,
           .count = 20,
           .node_size = 11,
           .node_range = 2,
           .node_powers = 7,
           .node_angle = 5},
    Layout{.kind = NlinkKind::kNodeFrame5,
           .name = "NodeFrame5",
           .id_size = 4,
           .local_time = 9,
           .system_time = 13,
           .voltage = 21,
           .count = 23,
           .node_size = 10,
           .node_range = 5,
           .node_powers = 8},
    Layout{.kind = NlinkKind::kNodeFrame6,
           .name = "NodeFrame6",
           .id_size = 4,
           .count = 13,
           .node_size = 7,
           .node_user_data = 5},
    // As in nlink_unpack/nlink_iot_frame0.c of github.com/nooploop-dev/nlink_parser; no recording.
    Layout{.kind = NlinkKind::kIotFrame0,
           .name = "IoT Frame0",
           .id = 4,
           .id_size = 4,
           .role = 0,
           .has_node_roles = false,
           .count = 13,
           .node_size = 14,
           .node_id = 0,
           .node_range = 4,
           .node_powers = 11,
           .node_user_data = 13,
           .node_user_data_size = 1},
};

/// TagFrame0 has eight ranges, to anchors 0 to 7, instead of nodes.
constexpr std::size_t kTagLength = 128;
constexpr std::size_t kTagRanges = 22;
constexpr std::size_t kTagAnchors = 8;

/// AnchorFrame0 has a fixed length, a tail instead of a checksum, and 30 tags, also empty ones.
constexpr std::size_t kAnchorLength = 896;
constexpr std::uint8_t kAnchorTail = 0xee;
constexpr std::size_t kAnchorFirstTag = 2;
constexpr std::size_t kAnchorTagSize = 27;
constexpr std::size_t kAnchorTags = 30;
constexpr std::uint8_t kNoTag = 0xff;

/// Offsets of NlinkMotion. Orientation: gyro, acceleration, 12 bytes, angles, quaternion.
struct MotionLayout {
  std::size_t position;
  std::size_t velocity;
  std::size_t error;
  std::size_t orientation;
};
constexpr MotionLayout kTagMotion{.position = 4, .velocity = 13, .error = 117, .orientation = 46};
constexpr MotionLayout kNodeMotion{.position = 13, .velocity = 22, .error = 10, .orientation = 40};
constexpr std::size_t kAccelerationOffset = 12;
constexpr std::size_t kAngles = 36;
constexpr std::size_t kQuaternion = 42;

const Layout* layout_of(NlinkKind kind) {
  const auto* const found = std::ranges::find(kLayouts, kind, &Layout::kind);
  return found == kLayouts.end() ? nullptr : found;
}

/// Empty: no frame of this protocol. Needs two bytes.
std::optional<NlinkKind> kind_of(Bytes bytes) {
  if (bytes[0] == kIotHeader && bytes[1] == 0x00) return NlinkKind::kIotFrame0;
  const NlinkKind kind{bytes[1]};
  if (bytes[0] != kNlinkHeader || kind == NlinkKind::kIotFrame0) return std::nullopt;
  return kind;
}

double int24_at(Bytes bytes, std::size_t at) {
  const auto value = static_cast<std::int32_t>(unsigned_at(bytes, at, 3));
  return value >= 0x800000 ? value - 0x1000000 : value;
}

Eigen::Vector3d int24_vector_at(Bytes bytes, std::size_t at) {
  return {int24_at(bytes, at), int24_at(bytes, at + 3), int24_at(bytes, at + 6)};
}

double angle_at(Bytes bytes, std::size_t at) {
  return radians(field_at<std::int16_t>(bytes, at) / 100.0);
}

Eigen::Vector4d wxyz_at(Bytes bytes, std::size_t at) {
  Eigen::Vector4d wxyz;
  wxyz << field_at<float>(bytes, at), vector_at<float>(bytes, at + 4);
  return wxyz;
}

std::size_t user_data_size(Bytes bytes, const Layout& layout, std::size_t node) {
  if (layout.node_user_data == 0) return 0;
  return layout.node_user_data_unit *
         unsigned_at(bytes, node + layout.node_user_data, layout.node_user_data_size);
}

/// Whether the nodes received so far can fill a frame of `length` bytes.
bool nodes_can_fill(Bytes bytes, const Layout& layout, std::size_t length) {
  const std::size_t end = length - 1;
  const std::size_t count = bytes[layout.count];
  if (layout.node_user_data == 0) return layout.first_node() + count * layout.node_size == end;
  std::size_t at = layout.first_node();
  for (std::size_t i = 0; i < count; ++i) {
    if (at + layout.node_size > end) return false;
    if (at + layout.node_size > bytes.size()) return true;
    at += layout.node_size + user_data_size(bytes, layout, at);
  }
  return at == end;
}

bool has_known_roles(Bytes frame, const Layout& layout) {
  if (layout.role != 0 && frame[layout.role] > kLastRole) return false;
  if (!layout.has_node_roles) return true;
  for (std::size_t at = layout.first_node(); at + 1 < frame.size();
       at += layout.node_size + user_data_size(frame, layout, at)) {
    if (frame[at] > kLastRole) return false;
  }
  return true;
}

/// TagFrame0 has no length field, so its content is checked: the quaternion has norm 1, or is zero
/// if the module has no inertial sensor.
FrameCheck examine_tag(Bytes bytes) {
  if (bytes.size() > 3 && bytes[3] > kLastRole) return {};
  if (bytes.size() < kTagLength) return {FrameKind::kIncomplete};
  if (byte_sum(bytes.first(kTagLength - 1)) != bytes[kTagLength - 1])
    return {FrameKind::kBadChecksum};
  if (begins_twice(bytes.first(kTagLength))) return {};
  const double norm = wxyz_at(bytes, kTagMotion.orientation + kQuaternion).norm();
  if (norm != 0.0 && !(std::abs(norm - 1.0) < 0.05)) return {};
  return {FrameKind::kComplete, kTagLength};
}

/// Without a checksum, the roles of the tags are checked as soon as they are there.
FrameCheck examine_anchor(Bytes bytes) {
  for (std::size_t tag = 0; tag < kAnchorTags; ++tag) {
    const std::size_t at = kAnchorFirstTag + tag * kAnchorTagSize;
    if (at + 1 >= bytes.size()) break;
    if (bytes[at] != kNoTag && bytes[at + 1] > kLastRole) return {};
  }
  if (bytes.size() < kAnchorLength) return {FrameKind::kIncomplete};
  if (bytes[kAnchorLength - 1] != kAnchorTail) return {};
  return {FrameKind::kComplete, kAnchorLength};
}

NlinkMotion motion_in(Bytes frame, const MotionLayout& at) {
  const std::size_t angles = at.orientation + kAngles;
  const Eigen::Vector4d wxyz = wxyz_at(frame, at.orientation + kQuaternion);
  return {.position_m = int24_vector_at(frame, at.position) / 1000.0,
          .position_error_m = vector_at<std::uint8_t>(frame, at.error) / 100.0,
          .velocity_mps = int24_vector_at(frame, at.velocity) / 10000.0,
          .gyro_radps = vector_at<float>(frame, at.orientation),
          .accel_mps2 = vector_at<float>(frame, at.orientation + kAccelerationOffset),
          .roll_pitch_yaw_rad = {angle_at(frame, angles), angle_at(frame, angles + 2),
                                 angle_at(frame, angles + 4)},
          .q = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3])};
}

NlinkFrame decode_tag(Bytes frame) {
  constexpr std::uint8_t kAnchor = 1;
  NlinkFrame decoded{.kind = NlinkKind::kTagFrame0,
                     .role = frame[3],
                     .module = frame[2],
                     .has_clock = true,
                     .local_time_ms = field_at<std::uint32_t>(frame, 108),
                     .system_time_ms = field_at<std::uint32_t>(frame, 112),
                     .voltage_v = field_at<std::uint16_t>(frame, 120) / 1000.0,
                     .motion = motion_in(frame, kTagMotion)};
  for (std::size_t i = 0; i < kTagAnchors; ++i) {
    const double range_m = int24_at(frame, kTagRanges + 3 * i) / 1000.0;
    if (range_m == 0.0) continue;  // no such anchor
    decoded.nodes.push_back(
        {.module = static_cast<std::uint32_t>(i), .range_m = range_m, .role = kAnchor});
  }
  return decoded;
}

NlinkNode decode_node(Bytes frame, const Layout& layout, std::size_t at) {
  NlinkNode node;
  if (layout.has_node_roles) node.role = frame[at];
  node.module = static_cast<std::uint32_t>(unsigned_at(frame, at + layout.node_id, layout.id_size));
  if (layout.node_range != 0) node.range_m = int24_at(frame, at + layout.node_range) / 1000.0;
  if (layout.node_powers != 0) {
    node.first_path_dbm = frame[at + layout.node_powers] / -2.0;
    node.received_dbm = frame[at + layout.node_powers + 1] / -2.0;
  }
  if (layout.node_time != 0)
    node.system_time_ms = field_at<std::uint32_t>(frame, at + layout.node_time);
  if (layout.node_angle != 0) node.angle_rad = angle_at(frame, at + layout.node_angle);
  if (layout.node_position != 0)
    node.position_m = int24_vector_at(frame, at + layout.node_position) / 1000.0;
  const Bytes user_data = frame.subspan(at + layout.node_size, user_data_size(frame, layout, at));
  if (layout.node_user_data != 0) node.user_data.assign(user_data.begin(), user_data.end());
  return node;
}

void append(std::vector<std::uint8_t>& out, std::uint32_t value, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(static_cast<std::uint8_t>(value >> 8U * i & 0xffU));
  }
}

std::uint32_t power_code(double dbm) {
  return static_cast<std::uint32_t>(std::clamp(std::lround(-2.0 * dbm), 0L, 255L));
}

}  // namespace

std::string_view name_of(NlinkKind kind) {
  if (kind == NlinkKind::kAnchorFrame0) return "AnchorFrame0";
  const Layout* layout = layout_of(kind);
  return layout == nullptr ? "TagFrame0" : layout->name;
}

bool has_ranges(NlinkKind kind) {
  if (kind == NlinkKind::kAnchorFrame0) return false;
  const Layout* layout = layout_of(kind);
  return layout == nullptr || layout->node_range != 0;
}

FrameCheck examine_nlink(Bytes bytes) {
  if (bytes[0] != kNlinkHeader && bytes[0] != kIotHeader && bytes[0] != 0xff) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (bytes[0] == 0xff) return {bytes[1] == 0x02 ? FrameKind::kForeign : FrameKind::kNone};
  const std::optional<NlinkKind> kind = kind_of(bytes);
  if (!kind) return {};
  if (kind == NlinkKind::kTagFrame0) return examine_tag(bytes);
  if (kind == NlinkKind::kAnchorFrame0) return examine_anchor(bytes);
  const Layout* layout = layout_of(*kind);
  if (layout == nullptr) return {};

  // The length field and the number of nodes must agree.
  if (bytes.size() < 4) return {FrameKind::kIncomplete};
  const std::size_t length = unsigned_at(bytes, 2, 2);
  if (length <= layout->first_node() || length > kLongestNlinkFrame) return {};
  if (bytes.size() < layout->first_node()) return {FrameKind::kIncomplete};
  if (!nodes_can_fill(bytes.first(std::min(bytes.size(), length)), *layout, length)) return {};
  if (bytes.size() < length) return {FrameKind::kIncomplete};
  if (byte_sum(bytes.first(length - 1)) != bytes[length - 1]) return {FrameKind::kBadChecksum};
  if (!has_known_roles(bytes.first(length), *layout) || begins_twice(bytes.first(length)))
    return {};
  return {FrameKind::kComplete, length};
}

NlinkFrame decode_nlink(Bytes frame) {
  const std::optional<NlinkKind> kind = kind_of(frame);
  CREPES_EXPECT(kind.has_value(), "a whole frame");
  if (kind == NlinkKind::kTagFrame0) return decode_tag(frame);
  if (kind == NlinkKind::kAnchorFrame0) return {.kind = NlinkKind::kAnchorFrame0};
  const Layout* layout = layout_of(*kind);
  CREPES_EXPECT(layout != nullptr, "a whole frame of a known kind");
  NlinkFrame decoded{
      .kind = *kind,
      .role = layout->role == 0 ? std::uint8_t{0} : frame[layout->role],
      .module = static_cast<std::uint32_t>(unsigned_at(frame, layout->id, layout->id_size)),
      .has_clock = layout->voltage != 0};
  if (decoded.has_clock) {
    decoded.local_time_ms = field_at<std::uint32_t>(frame, layout->local_time);
    decoded.system_time_ms = field_at<std::uint32_t>(frame, layout->system_time);
    decoded.voltage_v = field_at<std::uint16_t>(frame, layout->voltage) / 1000.0;
  }
  if (kind == NlinkKind::kNodeFrame2) decoded.motion = motion_in(frame, kNodeMotion);
  for (std::size_t at = layout->first_node(); at + 1 < frame.size();
       at += layout->node_size + user_data_size(frame, *layout, at)) {
    decoded.nodes.push_back(decode_node(frame, *layout, at));
  }
  return decoded;
}

std::vector<std::uint8_t> encode_node_frame3(std::uint8_t module, std::uint32_t system_time_ms,
                                             const std::vector<NlinkNode>& nodes) {
  constexpr std::uint8_t kRoleNode = 0;
  constexpr std::uint32_t kMillivolts = 4950;
  constexpr std::size_t kFixed = 21;
  constexpr std::size_t kPerNode = 7;
  CREPES_EXPECT(nodes.size() <= kMostNodes, "the number of nodes is one byte");
  std::vector<std::uint8_t> out{kNlinkHeader, static_cast<std::uint8_t>(NlinkKind::kNodeFrame3)};
  append(out, static_cast<std::uint32_t>(kFixed + nodes.size() * kPerNode + 1), 2);
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
  out.push_back(byte_sum(out));
  return out;
}

}  // namespace crepes
