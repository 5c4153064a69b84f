/// All that a daemon tells of itself, asked piece by piece: one datagram has no room for it.
#pragma once

#include <string>

#include "daemon/ctl/daemon_client.hpp"

namespace crepes {

struct FullStatus {
  std::string json;  ///< one STATUS object, as long as it has to be
  StatusMessage message;
};

/// Asks and waits for the answers, a second for each and up to three times. A daemon that never
/// answers is an error.
[[nodiscard]] Result<FullStatus> ask_full_status(const DaemonAddress& daemon);

}  // namespace crepes
