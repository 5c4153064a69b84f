/// FiRa ranging notifications, as Qorvo DW3000 boards with UCI firmware send them.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/uwb/uwb_ranges.hpp"

namespace crepes {

/// SESSION_INFO_NTF (earlier RANGE_DATA_NTF) of two-way ranging, with short or extended addresses:
/// header 62 00 00 length, then 25 bytes, then 31 bytes a measurement (uci_packets.pdl of Android's
/// uwb_uci_packets, Apache 2.0; fields as in FiRa's UCI specification). Distances in cm. An
/// extended address is named by its first four bytes. A program of the user must start the session;
/// other packets of UCI are skipped. There is no checksum.
struct FiraUci {
  static constexpr std::size_t kMaxFrame = 4 + 255;
  static constexpr std::string_view kForeignMeaning = {};
  static constexpr std::string_view kNoRanges = {};

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static UwbReading read(Bytes frame);
};

using FiraUciParser = UwbFrameParser<FiraUci>;

}  // namespace crepes
