/// Terminal settings of a serial line.
#pragma once

#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

/// Raw mode, 8N1, no flow control, at any rate that the adapter supports within 2 %. Also locks out
/// other programs, requests low latency from the adapter and discards bytes received earlier.
/// Errors begin with `name`.
[[nodiscard]] Result<void> set_raw_line(int fd, int baud, const std::string& name);

}  // namespace crepes
