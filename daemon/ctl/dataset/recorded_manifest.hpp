/// swarm.yaml of one robot's recording.
#pragma once

#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

/// The name of this robot among its swarm's members.
[[nodiscard]] std::string own_robot_name(const Config& config);

/// The text for measurements from `first` to `last` on the robot's clock, in the folder `dir`. True
/// time begins at `first`. Robots whose clock and its rate are known (as of `last`) are listed in
/// comments, for users who add the recordings of those robots.
[[nodiscard]] std::string recorded_manifest(const Config& config, const std::string& dir,
                                            Timestamp first, Timestamp last,
                                            const std::vector<client::Status::Clock>& clocks);

}  // namespace crepes
