/// WitMotion inertial sensors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// A sample is an acceleration frame (51) and the rate frame (52) that follows it.
class WitMotionParser {
 public:
  using Measurement = ImuSample;
  static constexpr std::size_t kMaxFrame = 11;
  static constexpr std::string_view kForeignMeaning = {};

  /// `bytes` begin a frame of this protocol?
  [[nodiscard]] static FrameCheck examine(Bytes bytes);

  /// A whole frame; the sample is stamped with the arrival of its second half.
  void parse(Bytes frame, Timestamp arrival, const std::function<void(const ImuSample&)>& sink);

  [[nodiscard]] static std::string why_nothing();
  [[nodiscard]] const ImuCounts& counts() const { return counts_; }

 private:
  struct Acceleration {
    Timestamp arrival{};
    Eigen::Vector3d mps2 = Eigen::Vector3d::Zero();
    bool saturated = false;
  };

  std::optional<Acceleration> acceleration_;
  DeviceClock clock_;  // without use: no frame has a time
  ImuCounts counts_;
};

/// The two frames of one sample. What the sensor cannot express saturates, as it does there.
[[nodiscard]] std::array<std::uint8_t, 22> encode_witmotion(const Eigen::Vector3d& gyro_radps,
                                                            const Eigen::Vector3d& accel_mps2);

}  // namespace crepes
