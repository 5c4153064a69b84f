/// The file with the key that all robots of a swarm share: 32 raw bytes.
#pragma once

#include <filesystem>
#include <string>

#include "estimator/core/result.hpp"
#include "net/mesh/packet_seal.hpp"

namespace crepes {

/// Writes a random key to a new file (`write_key_file`).
[[nodiscard]] Result<MeshKey> write_mesh_key(const std::filesystem::path& file);

/// Refuses what `read_key_file` refuses.
[[nodiscard]] Result<MeshKey> read_mesh_key(const std::filesystem::path& file);

/// Eight hexadecimal digits by which people see that two robots have the same key. The key cannot
/// be derived from them.
[[nodiscard]] std::string fingerprint(const MeshKey& key);

}  // namespace crepes
