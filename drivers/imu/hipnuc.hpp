/// HiPNUC inertial sensors.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// Frames `5a a5`, length, CRC, payload; a sample is a payload 0x91, or 0x81 of
/// those with GNSS.
struct Hipnuc {
  static constexpr std::size_t kMaxFrame = 6 + 512;
  static constexpr std::string_view kNoSamples =
      "the HiPNUC sensor sends no packet 0x91 or 0x81; choose HI91 with its set-up program";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static ImuReading read(Bytes frame);
};

using HipnucParser = ImuFrameParser<Hipnuc>;

}  // namespace crepes
