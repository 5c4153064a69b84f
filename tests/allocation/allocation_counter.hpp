/// What this program takes from the heap: it replaces operator new for everything in it.
#pragma once

#include <cstddef>

namespace crepes::test {

[[nodiscard]] std::size_t allocations();
[[nodiscard]] std::size_t allocated_bytes();

}  // namespace crepes::test
