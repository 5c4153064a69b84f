/// The file with the key that all robots of a swarm share: 32 bytes, as they are.
#pragma once

#include <filesystem>
#include <string>

#include "estimator/core/result.hpp"
#include "net/packet_seal.hpp"

namespace crepes {

/// Writes a random key to a new file that only its owner may read and write. A file that is there
/// is never touched; one that could not be written whole is removed.
[[nodiscard]] Result<MeshKey> write_mesh_key(const std::filesystem::path& file);

/// Refuses a file that is no key, and one that everybody on the robot may read or write.
[[nodiscard]] Result<MeshKey> read_mesh_key(const std::filesystem::path& file);

/// Eight hexadecimal digits by which people see that two robots have the same key; the key cannot
/// be told from them.
[[nodiscard]] std::string fingerprint(const MeshKey& key);

}  // namespace crepes
