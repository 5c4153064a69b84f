#include "net/subscription/system_status.hpp"

#include <algorithm>

namespace crepes {

void name_unknown_clocks(SystemStatus& status) {
  constexpr double kSilent_s = 2.0;
  const auto arrives = [&](RobotId robot) {
    const auto traffic = std::ranges::find(status.traffic, robot, &PeerTraffic::peer);
    return traffic != status.traffic.end() && traffic->age_s <= kSilent_s;
  };
  for (NeighborStatus& neighbor : status.estimator.neighbors) {
    const bool is_unheard =
        neighbor.reason == NoPoseReason::kNeverHeard || neighbor.reason == NoPoseReason::kSilent;
    const bool is_clock_known =
        std::ranges::count(status.clocks, neighbor.neighbor, &ClockStatus::peer) > 0;
    if (!is_unheard || is_clock_known || !arrives(neighbor.neighbor)) continue;
    neighbor.reason =
        status.estimator.tilt ? NoPoseReason::kNoClockOffset : NoPoseReason::kNoOwnImu;
  }
}

}  // namespace crepes
