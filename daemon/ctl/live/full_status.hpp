/// The complete status of a daemon, requested in parts: one datagram cannot hold it.
#pragma once

#include <string>

#include "net/client/daemon_client.hpp"

namespace crepes {

struct FullStatus {
  std::string json;  ///< one STATUS object of any length
  StatusMessage message;
};

/// Sends the requests and waits for the answers, up to three times one second for each. A daemon
/// that never answers is an error.
[[nodiscard]] Result<FullStatus> request_full_status(const DaemonAddress& daemon);

}  // namespace crepes
