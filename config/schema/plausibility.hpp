/// Settings that are possible but can hardly be meant.
#pragma once

#include <vector>

#include "config/schema/validation.hpp"

namespace crepes {

/// The shortest slot of whole milliseconds of which a camera of this rate sees two frames [ms].
[[nodiscard]] double readable_slot_ms(double rate_hz);

/// Warnings of a valid configuration. Those about devices and the network are of this machine, now.
[[nodiscard]] std::vector<RuleFault> doubtful_settings(const Config& config);

}  // namespace crepes
