/// VectorNav inertial sensors.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// Binary messages of group 1 (fa 01, field bits, fields, CRC) with the field Imu, and lines
/// `$VNIMU,mag x y z,accel x y z,gyro x y z,temperature,pressure*checksum`: measurements that the
/// sensor's filter has not touched. Else Accel and AngularRate of group 1. In the axes that are
/// printed on the sensor, z down.
struct VectorNav {
  static constexpr std::size_t kMaxFrame = 256;
  static constexpr std::string_view kNoSamples =
      "the VectorNav sensor sends neither VNIMU nor a binary message of group 1 with the field "
      "Imu; "
      "configure one of them, at imu.update_rate";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static ImuReading read(Bytes frame);
};

using VectorNavParser = ImuFrameParser<VectorNav>;

}  // namespace crepes
