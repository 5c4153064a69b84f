/// How a serial line is set: the kernel's side of it.
#pragma once

#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

/// Raw, 8N1, no flow control, at any rate that the adapter can make, within 2 %; then keeps other
/// programs out, has the adapter hand bytes on at once where it can, and throws away what was
/// received before. Errors begin with `name`.
[[nodiscard]] Result<void> set_raw_line(int fd, int baud, const std::string& name);

}  // namespace crepes
