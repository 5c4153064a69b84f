/// Xsens inertial sensors.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// Messages `fa`, bus, kind, length; a sample is an MTData2 (kind 36) that holds both the
/// acceleration and the rate of turn, in any of the number formats.
struct Xsens {
  static constexpr std::size_t kMaxFrame = 7 + 2048;
  static constexpr std::string_view kNoSamples =
      "the Xsens sensor does not send acceleration (4020) and rate of turn (8020) together; "
      "choose both, at the same rate, with MT Manager";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static ImuReading read(Bytes frame);
};

using XsensParser = ImuFrameParser<Xsens>;

}  // namespace crepes
