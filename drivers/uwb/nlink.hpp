/// NoopLoop LinkTrack ranging modules.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/uwb/nlink_frame.hpp"
#include "drivers/uwb/uwb_ranges.hpp"

namespace crepes {

/// Ranges of every kind of frame that has them. Ranges of NodeFrame2 carry their age.
struct Nlink {
  static constexpr std::size_t kMaxFrame = kLongestNlinkFrame;
  static constexpr std::string_view kForeignMeaning =
      "the LinkTrack module is in another mode (it sends ff 02); set DR_MODE0, role NODE and "
      "NodeFrame3 with NAssistant";
  static constexpr std::string_view kNoRanges = "choose NodeFrame3 with NAssistant";

  [[nodiscard]] static FrameCheck examine(Bytes bytes) { return examine_nlink(bytes); }
  [[nodiscard]] static UwbReading read(Bytes frame);
};

using NlinkParser = UwbFrameParser<Nlink>;

}  // namespace crepes
