/// A call of the operating system that failed.
#pragma once

#include <cerrno>
#include <string>
#include <system_error>

#include "estimator/core/result.hpp"

namespace crepes {

/// What failed, and the system's words for why.
[[nodiscard]] inline tl::unexpected<Error> io_failure(const std::string& what, int error = errno) {
  return fail(ErrorCode::kIo, what + ": " + std::generic_category().message(error));
}

}  // namespace crepes
