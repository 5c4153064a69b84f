/// Counts missing frames by the sequence numbers of the received ones.
#pragma once

#include <cstdint>
#include <optional>

namespace crepes {

/// The device numbers its frames consecutively. A number that decreases or jumps far ahead means
/// that the counter wrapped or restarted; missing frames are then unknown. The exception is the
/// 16-bit counter of GigE Vision, which wraps to 1. Pure.
class FrameSequence {
 public:
  void add(std::uint64_t number) {
    constexpr std::uint64_t kLast16Bit = 0xffff;
    constexpr std::uint64_t kFurthest = 1000;
    if (last_) {
      const bool wrapped = number < *last_ && *last_ <= kLast16Bit;
      const std::uint64_t step = number + (wrapped ? kLast16Bit : 0) - *last_;
      if (step > 1 && step <= kFurthest) missed_ += step - 1;
    }
    last_ = number;
  }

  [[nodiscard]] std::uint64_t missed() const { return missed_; }

 private:
  std::optional<std::uint64_t> last_;
  std::uint64_t missed_ = 0;
};

}  // namespace crepes
