/// The file with a robot's own key: 64 raw bytes.
#pragma once

#include <filesystem>

#include "estimator/core/result.hpp"
#include "net/mesh/packet_signature.hpp"

namespace crepes {

/// Writes a random key to a new file (`write_key_file`).
[[nodiscard]] Result<RobotKey> write_robot_key(const std::filesystem::path& file);

/// Refuses what `read_key_file` refuses, and a damaged key.
[[nodiscard]] Result<RobotKey> read_robot_key(const std::filesystem::path& file);

}  // namespace crepes
