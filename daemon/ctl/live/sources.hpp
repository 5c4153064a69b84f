/// crepesctl sources: the measurements behind each neighbor's pose, and their verdicts.
#pragma once

#include <string>
#include <vector>

#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

/// Options of `crepesctl sources`.
struct SourcesOptions {
  DaemonAddress daemon;
  double over_s = 1.0;  ///< the time over which rates are counted
  bool json = false;
};

/// One kind of measurement of one neighbor, or its reports.
struct Source {
  RobotId neighbor{};
  std::string name;  ///< the neighbor's
  std::string kind;  ///< bearing, peer_bearing, range, ..., reports, imu
  double rate_hz = 0.0;
  double age_s = 0.0;              ///< age of the newest; NaN if there was none
  std::uint64_t used = 0;          ///< since the daemon started
  client::Status::Totals refused;  ///< by reason
};

/// The rates between two statuses of a daemon, `elapsed_s` apart.
[[nodiscard]] std::vector<Source> sources_of(const client::Status& before,
                                             const client::Status& after, double elapsed_s);

[[nodiscard]] Result<std::string> sources(const SourcesOptions& options);

}  // namespace crepes
