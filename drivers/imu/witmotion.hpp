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

/// The packets of WitMotion sensors with Bluetooth, which also come out of their USB sockets and
/// receivers: `55 61`, acceleration, rate, angles. Answers to requests begin with `55 71`. Packets
/// have no checksum: only a packet in which no other begins is taken.
struct WitMotionBle {
  static constexpr std::size_t kMaxFrame =
      21;  ///< one byte more where the last could begin another
  static constexpr std::string_view kNoSamples =
      "the WitMotion sensor sends only answers (71); switch its default output (61) on with its "
      "set-up program";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static ImuReading read(Bytes frame);
};

using WitMotionBleParser = ImuFrameParser<WitMotionBle>;

/// The two frames of one sample. Values beyond the range saturate, as in the sensor.
[[nodiscard]] std::array<std::uint8_t, 22> encode_witmotion(const Eigen::Vector3d& gyro_radps,
                                                            const Eigen::Vector3d& accel_mps2);

}  // namespace crepes
