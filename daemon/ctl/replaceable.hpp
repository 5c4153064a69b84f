/// Which files a tool may replace without being told to.
#pragma once

#include <filesystem>
#include <string_view>

#include "estimator/core/result.hpp"

namespace crepes {

/// Refuses a file that somebody else has made: a configuration, or a calibration of another tool. A
/// result of the same kind has `mark` in its first line and may be replaced, as may what is empty,
/// missing, a device or a pipe.
[[nodiscard]] Result<void> check_replaceable(const std::filesystem::path& file,
                                             std::string_view mark);

}  // namespace crepes
