/// HiPNUC inertial sensors.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// Frames `5a a5`, length, CRC, payload. A sample is a payload 0x91 (HI91); 0x83 (HI83) whose
/// bitmap has acceleration and rate, in m/s^2 and rad/s; or 0x81 (HI81) of sensors with GNSS.
/// Layouts and units: c/hipnuc/hipnuc_dec.h of the maker's github.com/hipnuc/products, for firmware
/// from 1.6.9.
struct Hipnuc {
  static constexpr std::size_t kMaxFrame = 6 + 512;
  static constexpr std::string_view kNoSamples =
      "choose HI91 of the HiPNUC sensor, HI83 with acc_b, gyr_b and system_time, or HI81";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static ImuReading read(Bytes frame);
};

using HipnucParser = ImuFrameParser<Hipnuc>;

}  // namespace crepes
