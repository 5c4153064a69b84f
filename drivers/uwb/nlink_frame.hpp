/// The NLink protocol of NoopLoop LinkTrack modules: decoding of frames.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "drivers/serial/frame_decoder.hpp"

namespace crepes {

/// The second byte of a frame, but for the IoT modules' frame, which begins with another byte.
enum class NlinkKind : std::uint8_t {
  kAnchorFrame0 = 0x00,
  kTagFrame0 = 0x01,
  kNodeFrame0 = 0x02,
  kNodeFrame1 = 0x03,
  kNodeFrame2 = 0x04,
  kNodeFrame3 = 0x05,
  kNodeFrame4 = 0x06,
  kAoaNodeFrame0 = 0x07,
  kNodeFrame5 = 0x08,
  kNodeFrame6 = 0x09,
  kIotFrame0 = 0x6a,
};

/// The name in NAssistant.
[[nodiscard]] std::string_view name_of(NlinkKind kind);
[[nodiscard]] bool has_ranges(NlinkKind kind);

/// A module's report on one other module. Each kind of frame sets only some of the fields.
struct NlinkNode {
  std::uint32_t module = 0;
  double range_m = 0.0;         ///< of kinds with `has_ranges`
  double first_path_dbm = 0.0;  ///< both powers are 0 in TagFrame0, which has none
  double received_dbm = 0.0;
  std::uint8_t role = 0;
  std::optional<std::uint32_t> system_time_ms =
      std::nullopt;                                ///< NodeFrame2: when the range was measured
  std::optional<double> angle_rad = std::nullopt;  ///< AoaNodeFrame0
  std::optional<Eigen::Vector3d> position_m = std::nullopt;  ///< NodeFrame1
  std::vector<std::uint8_t> user_data = {};  ///< NodeFrame0, NodeFrame6, IotFrame0; NodeFrame4:
                                             ///< the tag's anchors
};

/// A tag's own state, in the axes of its anchors.
struct NlinkMotion {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d position_error_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d roll_pitch_yaw_rad = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
};

struct NlinkFrame {
  NlinkKind kind = NlinkKind::kNodeFrame3;
  std::uint8_t role = 0;
  std::uint32_t module = 0;
  bool has_clock = false;            ///< whether the times and the voltage are known
  std::uint32_t local_time_ms = 0;   ///< the module's own
  std::uint32_t system_time_ms = 0;  ///< the network's
  double voltage_v = 0.0;
  std::vector<NlinkNode> nodes = {};
  std::optional<NlinkMotion> motion = std::nullopt;  ///< NodeFrame2, TagFrame0
};

inline constexpr std::size_t kLongestNlinkFrame = 119 + 255 * 13 + 1;  ///< NodeFrame2, 255 nodes

/// Whether `bytes` begin with a frame of this protocol.
[[nodiscard]] FrameCheck examine_nlink(Bytes bytes);

/// Decodes a whole frame that `examine_nlink` found. Of AnchorFrame0, which has no checksum, only
/// the kind is read.
[[nodiscard]] NlinkFrame decode_nlink(Bytes frame);

}  // namespace crepes
