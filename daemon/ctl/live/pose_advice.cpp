#include "daemon/ctl/live/pose_advice.hpp"

#include <array>
#include <cstddef>

namespace crepes {
namespace {

/// In the order of NoPoseReason.
constexpr std::array<std::string_view, 14> kAdvice{
    "",
    "Check the mesh, net.interface, a firewall on UDP 47474, the key, and whether its crepesd "
    "runs and its IMU works: without gravity it sends nothing.",
    "Out of reach, or its battery or daemon has stopped.",
    "Wait two seconds. If it stays, ours do not arrive there, or our IMU gives no tilt: then we "
    "send none.",
    "See the IMU among the sensors.",
    "Its IMU is silent or faulty: check there.",
    "Hold still for a second. Wrong axes in imu.T_body_imu also cause it.",
    "Is it in view? Are its LEDs on? Check exposure_us and vision.threshold.",
    "It reports no bearing of our board. Check our LEDs, and its camera.",
    "No UWB distance between the two. Check the modules' ids and channel.",
    "Almost straight above or below: yaw is not observable. Move aside.",
    "Move more than half a meter apart.",
    "Bearings do not agree. Look for reflections and for lamps that blink.",
    "Known worse than 1 m or 20 deg: too few measurements, see the links.",
};
static_assert(kAdvice.size() == static_cast<std::size_t>(NoPoseReason::kUncertain) + 1);

}  // namespace

std::string_view advice_for(NoPoseReason reason) {
  return kAdvice[static_cast<std::size_t>(reason)];
}

std::string_view advice_for(std::string_view reason) {
  for (std::size_t i = 0; i < kAdvice.size(); ++i)
    if (name_of(static_cast<NoPoseReason>(i)) == reason) return kAdvice[i];
  return {};
}

}  // namespace crepes
