/// The rules between settings, which the schema in config.hpp cannot tell.
#pragma once

#include <string>
#include <vector>

#include "estimator/core/config.hpp"

namespace crepes {

/// A rule that is broken, and the key (a dotted path) that breaks it.
struct RuleFault {
  std::string key;
  std::string reason;
};

/// Ids that are not set (0) break no rule: the reader has told their fault already.
[[nodiscard]] std::vector<RuleFault> validate(const Config& config);

}  // namespace crepes
