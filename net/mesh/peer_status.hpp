/// The state of the mesh and of the traffic with one peer.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// The estimate of a peer's clock.
struct ClockStatus {
  RobotId peer{};
  double offset_s = 0.0;  ///< peer's clock minus ours
  double skew_ppm = 0.0;
  double sigma_s = 0.0;
};

/// Two robots with one id.
struct DoubledId {
  RobotId robot{};
  Timestamp last{};  ///< when the second one was heard
};

/// Totals of one peer's datagrams.
struct PeerTraffic {
  RobotId peer{};
  std::uint64_t received = 0;
  std::uint64_t lost = 0;      ///< gaps in the peer's sequence
  std::uint64_t restarts = 0;  ///< of the peer or of its clock
  double age_s = 0.0;          ///< since the last datagram
  double loss = 0.0;           ///< share of the recent datagrams
};

/// Shares of the channel's time (`airtime` in send_pacing.hpp), over the last second.
struct AirShare {
  double own = 0.0;  ///< what this robot sends
  double all = 0.0;  ///< that, and what the robots send that it hears; without what they forward
  std::map<RobotId, double> of_peers;  ///< what each of them sends
};

/// How this robot's datagrams are protected, and what they cost.
struct MeshStatus {
  bool is_sealed = false;
  bool is_signed = false;
  std::string warning;  ///< who could speak for whom; empty if each robot only for itself
  AirShare air;
};

}  // namespace crepes
