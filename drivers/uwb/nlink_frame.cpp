#include "drivers/uwb/nlink_frame.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/serial/byte_fields.hpp"
#include "drivers/uwb/nlink_layout.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr std::uint8_t kNlinkHeader = 0x55;
constexpr std::uint8_t kIotHeader = 0x6a;
constexpr std::uint8_t kLastRole = 6;

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

const NlinkLayout* layout_of(NlinkKind kind) {
  const auto* const found = std::ranges::find(kNlinkLayouts, kind, &NlinkLayout::kind);
  return found == kNlinkLayouts.end() ? nullptr : found;
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

std::size_t user_data_size(Bytes bytes, const NlinkLayout& layout, std::size_t node) {
  if (layout.node_user_data == 0) return 0;
  return layout.node_user_data_unit *
         unsigned_at(bytes, node + layout.node_user_data, layout.node_user_data_size);
}

/// Whether the nodes received so far can fill a frame of `length` bytes.
bool nodes_can_fill(Bytes bytes, const NlinkLayout& layout, std::size_t length) {
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

bool has_known_roles(Bytes frame, const NlinkLayout& layout) {
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

NlinkNode decode_node(Bytes frame, const NlinkLayout& layout, std::size_t at) {
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

}  // namespace

std::string_view name_of(NlinkKind kind) {
  if (kind == NlinkKind::kAnchorFrame0) return "AnchorFrame0";
  const NlinkLayout* layout = layout_of(kind);
  return layout == nullptr ? "TagFrame0" : layout->name;
}

bool has_ranges(NlinkKind kind) {
  if (kind == NlinkKind::kAnchorFrame0) return false;
  const NlinkLayout* layout = layout_of(kind);
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
  const NlinkLayout* layout = layout_of(*kind);
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
  const NlinkLayout* layout = layout_of(*kind);
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

}  // namespace crepes
