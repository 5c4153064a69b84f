/// A recorded swarm from disk, with its truth.
#pragma once

#include <filesystem>

#include "tests/study/pair_sightings.hpp"

namespace crepes::study {

[[nodiscard]] inline Result<Swarm> load_swarm_with_truth(const std::filesystem::path& dir) {
  auto dataset = load_swarm(dir);
  if (!dataset) return tl::unexpected(dataset.error());
  auto truth = SwarmTruth::load(dir, dataset->manifest);
  if (!truth) return tl::unexpected(truth.error());
  return Swarm{std::move(*dataset), std::move(*truth)};
}

}  // namespace crepes::study
