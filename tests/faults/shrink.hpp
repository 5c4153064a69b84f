/// The smallest part of a schedule that still goes wrong.
#pragma once

#include <functional>
#include <vector>

#include "tests/faults/fault.hpp"

namespace crepes::faults {

/// Leaves out faults, then ends them earlier, then lowers their rates, as long as `breaks`. A
/// schedule of n faults is tried at most n + 8 n times.
[[nodiscard]] std::vector<Fault> shrunk(
    std::vector<Fault> faults, const std::function<bool(const std::vector<Fault>&)>& breaks);

}  // namespace crepes::faults
