/// crepesctl codebook: blink patterns for a swarm.
#pragma once

#include <cstddef>
#include <string>

#include "estimator/core/result.hpp"
#include "estimator/vision/codebook.hpp"

namespace crepes {

struct CodebookOptions {
  std::size_t ids = 64;
  CodebookRules rules{};
  CodebookSearch search{};
  bool json = false;
};

/// The section `swarm` of a configuration with `ids` members; in JSON, which a configuration may be
/// written in, too, if that is wanted. When so many patterns are not found,
/// the error says how many were and which rule to loosen.
[[nodiscard]] Result<std::string> codebook(const CodebookOptions& options);

}  // namespace crepes
