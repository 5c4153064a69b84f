/// The client library, as the tools use it: with their types and errors.
#pragma once

#include <sys/types.h>

#include <string>

#include "estimator/core/outputs.hpp"
#include "estimator/core/result.hpp"
#include "net/client/client.hpp"

namespace crepes {

using DaemonAddress = client::Address;

/// An address that is none is an error; a daemon that does not run is not.
[[nodiscard]] Result<client::Connection> connect(const DaemonAddress& daemon,
                                                 const client::Requests& requests);

/// The error for a daemon that did not answer. `send_fault` is why it could not even be asked.
[[nodiscard]] Error no_answer_from(const DaemonAddress& daemon, const std::string& send_fault = "");

/// Asks a daemon on this machine to read its configuration again.
[[nodiscard]] Result<void> ask_to_reload(pid_t daemon);

/// Without a covariance it is zero.
[[nodiscard]] NeighborPose neighbor_pose_of(const client::Pose& pose);

}  // namespace crepes
