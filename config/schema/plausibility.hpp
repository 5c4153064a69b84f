/// Settings that are possible but can hardly be meant.
#pragma once

#include <vector>

#include "config/schema/validation.hpp"

namespace crepes {

/// Warnings of a valid configuration. Those about devices and the network are of this machine, now.
[[nodiscard]] std::vector<RuleFault> doubtful_settings(const Config& config);

}  // namespace crepes
