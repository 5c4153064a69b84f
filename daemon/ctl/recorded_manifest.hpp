/// swarm.yaml of one robot's recording.
#pragma once

#include <string>
#include <vector>

#include "daemon/ctl/daemon_client.hpp"
#include "estimator/core/config.hpp"

namespace crepes {

/// The name of this robot among its swarm's members.
[[nodiscard]] std::string own_name(const Config& config);

/// The text for measurements from `first` to `last` of the robot's clock. True time begins with
/// `first`. Robots whose clocks it knew (as of `last`) are listed in comments, ready for whoever
/// puts their recordings beside this one.
[[nodiscard]] std::string recorded_manifest(const Config& config, Timestamp first, Timestamp last,
                                            const std::vector<StatusMessage::Clock>& clocks);

}  // namespace crepes
