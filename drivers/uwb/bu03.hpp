/// Ai-Thinker BU03 and BU04 boards (DW3000) with the maker's AT firmware, two-way ranging.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/uwb/uwb_ranges.hpp"

namespace crepes {

/// What the data output of a tag sends, 37 bytes: `aa 25 01`, the distances to the base stations 0
/// to 7 in mm (four bytes each, little-endian; 0: not heard), a byte of unknown meaning, `55`. The
/// maker publishes no layout: this is what three programs of users have in common, one of them with
/// bytes of a board (config/docs/sensors.md names them). There is no checksum. The frame does not
/// name its tag, so the board must be a tag. Its id and those of base stations must differ.
struct Bu03 {
  static constexpr std::size_t kMaxFrame = 37;
  static constexpr std::string_view kForeignMeaning = {};
  static constexpr std::string_view kNoRanges = {};

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static UwbReading read(Bytes frame);
};

using Bu03Parser = UwbFrameParser<Bu03>;

}  // namespace crepes
