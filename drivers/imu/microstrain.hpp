/// MicroStrain inertial sensors (3DM-CV5, CV7, CX5, GX5, GQ7).
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// MIP packets `75 65`, descriptor set, length, fields, Fletcher checksum, all big-endian. A sample
/// is a packet of sensor data (set 80) with scaled acceleration (04, in g) and scaled rate (05, in
/// rad/s); the time is the reference timestamp (d5) if it is there. In the axes that are printed on
/// the sensor, z down.
struct MicroStrain {
  static constexpr std::size_t kMaxFrame = 4 + 255 + 2;
  static constexpr std::string_view kNoSamples =
      "the MicroStrain sensor does not send scaled acceleration (80, 04) and scaled rate (80, 05) "
      "in "
      "one packet; choose both, at the same rate, with SensorConnect";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static ImuReading read(Bytes frame);
};

using MicroStrainParser = ImuFrameParser<MicroStrain>;

}  // namespace crepes
