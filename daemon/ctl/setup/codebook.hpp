/// crepesctl codebook: blink patterns for a swarm.
#pragma once

#include <cstddef>
#include <string>

#include "estimator/core/result.hpp"
#include "estimator/vision/codebook.hpp"

namespace crepes {

/// Options of `crepesctl codebook`.
struct CodebookOptions {
  std::size_t ids = 64;
  CodebookRules rules{};
  CodebookSearch search{};
  bool json = false;
};

/// The section `swarm` of a configuration with `ids` members, as YAML or JSON; a configuration may
/// be written in either. If there are not enough patterns, the error reports how many were found
/// and which rule to relax.
[[nodiscard]] Result<std::string> codebook(const CodebookOptions& options);

}  // namespace crepes
