/// Delivers settings to one stage: at the start, and after each reload that changes them.
#pragma once

#include <optional>
#include <utility>

#include "daemon/stages/bounded_queue.hpp"

namespace crepes {

/// The main thread compares and sends, the stage receives.
template <class Settings>
class LiveSettings {
 public:
  explicit LiveSettings(Settings initial) : current_(std::move(initial)) { queue_.push(current_); }

  /// For the main thread. Sends the settings only if they differ from the current ones.
  void update(Settings wanted) {
    if (wanted == current_) return;
    current_ = std::move(wanted);
    queue_.push(current_);
  }

  /// The newest settings that the stage has not received yet. There are some when the stage starts.
  [[nodiscard]] std::optional<Settings> receive() { return queue_.try_pop(); }
  [[nodiscard]] bool has_update() const { return !queue_.empty(); }

 private:
  Settings current_;
  BoundedQueue<Settings> queue_{1, Overflow::kDropOldest};
};

}  // namespace crepes
