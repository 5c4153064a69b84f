/// Mad contents behind a valid checksum, signature and seal, into the link and the estimator.
#pragma once

#include <span>
#include <vector>

#include "tests/fuzz/fuzz_targets.hpp"

namespace crepes {

/// A conversation of two robots. Each datagram of the second takes its changes from the input: a
/// byte with how many, then two bytes with a place and one with the bits for each.
void run_mesh(std::span<const std::uint8_t> data);
[[nodiscard]] std::vector<FuzzInput> mesh_seeds();

}  // namespace crepes
