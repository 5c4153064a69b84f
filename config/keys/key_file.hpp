/// Files that hold a secret: raw bytes, closed to everybody but owner and group.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "estimator/core/result.hpp"

namespace crepes {

/// Writes a new file that only its owner may read and write. An existing file is never changed. An
/// incompletely written file is removed.
[[nodiscard]] Result<void> write_key_file(const std::filesystem::path& file,
                                          std::span<const std::uint8_t> key);

/// Fills `key` from a file of that size. Refuses any other, and a file that every user of the robot
/// may read or write. After an error the content of `key` is unspecified.
[[nodiscard]] Result<void> read_key_file(const std::filesystem::path& file,
                                         std::span<std::uint8_t> key);

}  // namespace crepes
