/// Text files as a whole.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

/// More than any file that is read as a whole.
inline constexpr std::uintmax_t kNoSizeLimit = UINTMAX_MAX;
/// What a file written by hand may have: a configuration or a calibration.
inline constexpr std::uintmax_t kMaxConfigBytes = 1U << 20U;

/// The whole of a file of at most `max_bytes`; kNotFound if it cannot be opened. The error does not
/// name the file.
[[nodiscard]] Result<std::string> read_text(const std::filesystem::path& file,
                                            std::uintmax_t max_bytes = kNoSizeLimit);

/// As `read_text`; refuses what is no regular file, and the error names the file.
[[nodiscard]] Result<std::string> read_text_file(const std::filesystem::path& file,
                                                 std::uintmax_t max_bytes = kNoSizeLimit);

}  // namespace crepes
