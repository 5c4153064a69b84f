/// The rules between settings, which the schema in config.hpp cannot express.
#pragma once

#include <string>
#include <vector>

#include "config/schema/config.hpp"

namespace crepes {

/// A broken rule, and the key (a dotted path) that breaks it.
struct RuleFault {
  std::string key;
  std::string reason;
};

/// Unset ids (0) break no rule: the reader has already reported them.
[[nodiscard]] std::vector<RuleFault> validate(const Config& config);

}  // namespace crepes
