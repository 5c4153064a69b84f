#include "drivers/detect_protocol.hpp"

#include <array>

#include "drivers/imu/hipnuc.hpp"
#include "drivers/imu/mavlink.hpp"
#include "drivers/imu/microstrain.hpp"
#include "drivers/imu/vectornav.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/imu/xsens.hpp"
#include "drivers/uwb/bu03.hpp"
#include "drivers/uwb/dwm1001.hpp"
#include "drivers/uwb/fira_uci.hpp"
#include "drivers/uwb/mauwb.hpp"
#include "drivers/uwb/nlink_frame.hpp"
#include "drivers/uwb/range_line.hpp"

namespace crepes {
namespace {

struct Candidate {
  SerialProtocol protocol;
  std::string_view name;
  FrameCheck (*examine)(Bytes);
};

/// Comments alone would make any text a list of ranges.
FrameCheck examine_range_line(Bytes bytes) {
  return bytes[0] == '#' ? FrameCheck{} : RangeLine::examine(bytes);
}

constexpr std::array kCandidates{
    Candidate{SerialProtocol::kNlink, "LinkTrack", &examine_nlink},
    Candidate{SerialProtocol::kDwm1001Shell, "dwm1001", &Dwm1001Shell::examine},
    Candidate{SerialProtocol::kDwm1001Tlv, "dwm1001_tlv", &Dwm1001Tlv::examine},
    Candidate{SerialProtocol::kMaUwb, "mauwb", &MaUwb::examine},
    Candidate{SerialProtocol::kFiraUci, "fira", &FiraUci::examine},
    Candidate{SerialProtocol::kBu03, "bu03", &Bu03::examine},
    Candidate{SerialProtocol::kRangeLine, "lines", &examine_range_line},
    Candidate{SerialProtocol::kWitMotion, "witmotion", &WitMotion::examine},
    Candidate{SerialProtocol::kHipnuc, "hipnuc", &Hipnuc::examine},
    Candidate{SerialProtocol::kVectorNav, "vectornav", &VectorNav::examine},
    Candidate{SerialProtocol::kMicroStrain, "microstrain", &MicroStrain::examine},
    Candidate{SerialProtocol::kXsens, "xsens", &Xsens::examine},
    Candidate{SerialProtocol::kMavlink, "mavlink", &Mavlink::examine},
    Candidate{SerialProtocol::kWitMotionBle, "witmotion_ble", &WitMotionBle::examine}};

bool speaks(const Candidate& candidate, Bytes recent) {
  constexpr std::size_t kEnoughFrames = 3;
  std::size_t frames = 0;
  std::size_t filled = 0;
  for (std::size_t at = 0; at < recent.size();) {
    const FrameCheck check = candidate.examine(recent.subspan(at));
    const bool is_frame = check.kind == FrameKind::kComplete;
    frames += is_frame ? 1 : 0;
    filled += check.length;
    at += is_frame ? check.length : 1;
  }
  return frames >= kEnoughFrames && 4 * filled >= recent.size();
}

}  // namespace

std::string_view name_of(SerialProtocol protocol) {
  for (const Candidate& candidate : kCandidates) {
    if (candidate.protocol == protocol) return candidate.name;
  }
  return "";
}

bool is_of_uwb(SerialProtocol protocol) { return protocol <= SerialProtocol::kRangeLine; }

std::optional<SerialProtocol> detect_protocol(Bytes recent) {
  for (const Candidate& candidate : kCandidates) {
    if (speaks(candidate, recent)) return candidate.protocol;
  }
  return std::nullopt;
}

}  // namespace crepes
