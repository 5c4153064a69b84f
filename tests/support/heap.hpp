/// What this program has on the heap.
#pragma once

#include <malloc.h>

#include <cstdint>

namespace crepes::test {

/// Zero under sanitizers, which have a heap of their own.
inline std::int64_t heap_bytes() {
  const struct mallinfo2 heap = ::mallinfo2();
  return static_cast<std::int64_t>(heap.uordblks + heap.hblkhd);
}

}  // namespace crepes::test
