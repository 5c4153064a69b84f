/// A swarm from memory as a data set on disk, for the tools that read one.
#pragma once

#include <filesystem>

#include "tests/study/pair_sightings.hpp"

namespace crepes::study {

/// Writes swarm.yaml, each robot's configuration, IMU, ranges and spots, and truth/. What is in
/// `dir` already is overwritten. False if something could not be written.
[[nodiscard]] bool write_swarm(const std::filesystem::path& dir, const Swarm& swarm);

}  // namespace crepes::study
