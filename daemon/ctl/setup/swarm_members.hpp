/// The members of a swarm from any file that has them.
#pragma once

#include <filesystem>

#include "estimator/core/result.hpp"
#include "estimator/core/swarm_config.hpp"

namespace crepes {

/// The section `swarm`. A library contains nothing else; other sections of a configuration are
/// ignored.
[[nodiscard]] Result<SwarmConfig> load_members(const std::filesystem::path& file);

}  // namespace crepes
