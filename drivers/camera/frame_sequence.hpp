/// Frames that are missing, told by the numbers of those that came.
#pragma once

#include <cstdint>
#include <optional>

namespace crepes {

/// Counts what is missing between frames that their device numbers one by one. A number that goes
/// back, or leaps far ahead, is a counter that wrapped or began anew: nothing is missing then that
/// could be told, but for GigE Vision's 16 bit, which wrap to 1. Pure.
class FrameSequence {
 public:
  void note(std::uint64_t number) {
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
