/// Stream sockets with a name in the file system.
#pragma once

#include <string>

#include "drivers/base/unique_fd.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Listens without blocking. The owner and the group of this process may connect. Replaces a socket
/// file that no process listens on, and no other file.
[[nodiscard]] Result<UniqueFd> listen_unix(const std::string& path);
[[nodiscard]] Result<UniqueFd> connect_unix(const std::string& path, int flags = 0);

}  // namespace crepes
