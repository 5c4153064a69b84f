/// WitMotion inertial sensors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include "drivers/serial/frame_decoder.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

struct WitMotionCounts {
  std::uint64_t samples = 0;
  std::uint64_t incomplete = 0;   ///< rates without the acceleration that belongs to them
  std::uint64_t implausible = 0;  ///< at the end of a scale, or an accelerometer that reads zero
};

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

  [[nodiscard]] const WitMotionCounts& counts() const { return counts_; }

 private:
  struct Acceleration {
    Timestamp arrival{};
    Eigen::Vector3d mps2 = Eigen::Vector3d::Zero();
    bool plausible = false;
  };

  std::optional<Acceleration> acceleration_;
  WitMotionCounts counts_;
};

/// The two frames of one sample. What the sensor cannot express saturates, as it does there.
[[nodiscard]] std::array<std::uint8_t, 22> encode_witmotion(const Eigen::Vector3d& gyro_radps,
                                                            const Eigen::Vector3d& accel_mps2);

}  // namespace crepes
