/// Ranges as lines of text, for modules without a decoder of their own.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/uwb/uwb_ranges.hpp"

namespace crepes {

/// Lines `range <id> <metres> [<first_path_dbm> <rx_dbm>]`; others that begin with `#` are ignored.
/// A line counts only as a whole. It has no checksum: a changed digit is a wrong range.
struct RangeLine {
  static constexpr std::size_t kMaxFrame = 80;
  static constexpr std::string_view kForeignMeaning = {};
  static constexpr std::string_view kNoRanges = "send lines: range <id> <metres>";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static UwbReading read(Bytes frame);
};

using RangeLineParser = UwbFrameParser<RangeLine>;

}  // namespace crepes
