/// crepesctl keygen: the key that all robots of a swarm share.
#pragma once

#include <filesystem>

#include "estimator/core/result.hpp"

namespace crepes {

/// Writes 32 random bytes to a new file that only its owner may read and write. A file that is
/// there is never touched; one that could not be written whole is removed.
[[nodiscard]] Result<void> write_mesh_key(const std::filesystem::path& file);

}  // namespace crepes
