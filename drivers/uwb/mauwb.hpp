/// Makerfabs MaUWB boards: ESP32 and DW3000 with the AT firmware.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/uwb/uwb_ranges.hpp"

namespace crepes {

/// Lines as these, distances in cm:
///   AT+RANGE=tid:4,mask:01,seq:218,range:(100,110,0,0,0,0,0,0),ancid:(0,1,-1,-1,-1,-1,-1,-1)
///   AT+RANGE=tid:1,mask:04,seq:63,range:(0,0,30,0,0,0,0,0),rssi:(0.00,0.00,-77.93,...)
/// Without `ancid` the place in the list is the anchor's id; 0 cm means that it was not heard.
/// Tags and anchors must not share ids. A board also reports the ranges of others.
struct MaUwb {
  static constexpr std::size_t kMaxFrame = 320;
  static constexpr std::string_view kForeignMeaning = {};
  static constexpr std::string_view kNoRanges = {};

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static UwbReading read(Bytes frame);
};

using MaUwbParser = UwbFrameParser<MaUwb>;

}  // namespace crepes
