/// The only state that threads share besides queues: numbers that only grow.
#pragma once

#include <atomic>
#include <cstdint>

namespace crepes {

/// Counts events, or the iterations of a loop for the watchdog. Thread-safe.
class Counter {
 public:
  void add(std::uint64_t n = 1) { value_.fetch_add(n, std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t value() const { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

}  // namespace crepes
