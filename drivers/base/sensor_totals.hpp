/// Event counts of a sensor and its driver.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace crepes {

/// Counts by name.
using Totals = std::vector<std::pair<std::string, std::uint64_t>>;

/// The driver assigns each count to one of the two lists.
struct SensorTotals {
  Totals faults;  ///< data lost, damaged or refused, by reason; all zero in normal operation
  Totals counts;  ///< normal events and measured values
};

}  // namespace crepes
