/// Mad contents behind a valid checksum and seal, into the link and the estimator.
#pragma once

#include <span>
#include <vector>

#include "tests/fuzz/fuzz_targets.hpp"

namespace crepes {

/// A conversation with a neighbor. Each input changes its next datagram: a byte with how many
/// fields, then the changes of `BodyChanger`. The pair goes on from input to input and is renewed
/// from time to time. With CREPES_FUZZ_HISTORY in the environment, that file has all inputs of the
/// present pair, one a line: `fuzz_corpus run mesh FILE` repeats what failed.
void run_mesh(std::span<const std::uint8_t> data);
[[nodiscard]] std::vector<FuzzInput> mesh_seeds();

}  // namespace crepes
