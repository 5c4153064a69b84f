/// WitMotion inertial sensors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// A sample is an acceleration frame (51) and the rate frame (52) that follows without a gap. Both
/// together count as one frame here. A single half is not a sample.
struct WitMotion {
  static constexpr std::size_t kMaxFrame = 22;
  static constexpr std::string_view kNoSamples =
      "the WitMotion sensor does not send acceleration (51) and rate (52) together; switch both on "
      "with its set-up program";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static ImuReading read(Bytes frame);
};

using WitMotionParser = ImuFrameParser<WitMotion>;

/// The two frames of one sample. Values beyond the range saturate, as in the sensor.
[[nodiscard]] std::array<std::uint8_t, 22> encode_witmotion(const Eigen::Vector3d& gyro_radps,
                                                            const Eigen::Vector3d& accel_mps2);

}  // namespace crepes
