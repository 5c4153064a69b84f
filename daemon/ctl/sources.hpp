/// crepesctl sources: which measurements each neighbor's pose rests on, and what becomes of them.
#pragma once

#include <string>
#include <vector>

#include "daemon/ctl/daemon_client.hpp"

namespace crepes {

struct SourcesOptions {
  DaemonAddress daemon;
  double over_s = 1.0;  ///< for so long rates are counted
  bool json = false;
};

/// One kind of measurement of one neighbor, or its reports.
struct Source {
  RobotId neighbor{};
  std::string name;  ///< the neighbor's
  std::string kind;  ///< bearing, peer_bearing, range, ..., reports, imu
  double rate_hz = 0.0;
  double age_s = 0.0;             ///< of the newest; NaN where there never was one
  std::uint64_t used = 0;         ///< since the daemon started
  StatusMessage::Totals refused;  ///< by reason
};

/// What changed between two looks at a daemon, `elapsed_s` apart.
[[nodiscard]] std::vector<Source> sources_of(const StatusMessage& before,
                                             const StatusMessage& after, double elapsed_s);

[[nodiscard]] Result<std::string> sources(const SourcesOptions& options);

}  // namespace crepes
