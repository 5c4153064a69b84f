/// The only way from thread to thread: a queue with a capacity and an overflow policy.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

#include "estimator/core/contract.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// Which value a full queue drops.
enum class Overflow : std::uint8_t { kDropOldest, kDropNewest };

/// First in, first out. Producers never wait for consumers. Thread-safe.
template <class T>
class BoundedQueue {
 public:
  BoundedQueue(std::size_t capacity, Overflow overflow) : capacity_(capacity), overflow_(overflow) {
    CREPES_EXPECT(capacity > 0, "a queue holds at least one value");
  }

  void push(T value) {
    {
      const std::lock_guard lock(mutex_);
      if (values_.size() == capacity_) {
        ++dropped_;
        if (overflow_ == Overflow::kDropNewest) return;
        values_.pop_front();
      }
      values_.push_back(std::move(value));
    }
    arrived_.notify_one();
  }

  /// Waits for a value; empty once `stop` is requested.
  [[nodiscard]] std::optional<T> pop(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, stop, [this] { return !values_.empty(); });
    return stop.stop_requested() ? std::nullopt : pop_front();
  }

  /// Waits no longer than `timeout`; empty when there was nothing, or once `stop` is requested.
  [[nodiscard]] std::optional<T> pop_for(Duration timeout, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    arrived_.wait_for(lock, stop, timeout, [this] { return !values_.empty(); });
    return stop.stop_requested() ? std::nullopt : pop_front();
  }

  /// The first value, without waiting; empty if there is none.
  [[nodiscard]] std::optional<T> try_pop() {
    const std::lock_guard lock(mutex_);
    return pop_front();
  }

  [[nodiscard]] bool empty() const {
    const std::lock_guard lock(mutex_);
    return values_.empty();
  }

  /// The number of values dropped since the start.
  [[nodiscard]] std::uint64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  [[nodiscard]] std::optional<T> pop_front() {
    if (values_.empty()) return std::nullopt;
    std::optional<T> value(std::move(values_.front()));
    values_.pop_front();
    return value;
  }

  const std::size_t capacity_;
  const Overflow overflow_;
  mutable std::mutex mutex_;
  std::condition_variable_any arrived_;
  std::deque<T> values_;
  std::uint64_t dropped_ = 0;
};

/// Waits for `timeout`, or less once `stop` is requested.
inline void wait_for(Duration timeout, const std::stop_token& stop) {
  BoundedQueue<int> silent{1, Overflow::kDropOldest};
  static_cast<void>(silent.pop_for(timeout, stop));
}

}  // namespace crepes
