/// What a sensor and those who read it have counted.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace crepes {

/// By name.
using Totals = std::vector<std::pair<std::string, std::uint64_t>>;

/// Whoever counts says which of both it is.
struct SensorTotals {
  Totals faults;  ///< what was lost, damaged or refused, by reason: none where all is well
  Totals counts;  ///< what is as it should be, and figures
};

}  // namespace crepes
