/// The complete status of a daemon, requested in parts: one datagram cannot hold it.
#pragma once

#include <string>

#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

struct FullStatus {
  std::string json;  ///< one STATUS object of any length
  client::Status message;
};

/// Sends the requests and waits for the answers, up to three times one second for each. A daemon
/// that never answers is an error.
[[nodiscard]] Result<FullStatus> request_full_status(const DaemonAddress& address);

}  // namespace crepes
