/// The content of one frame of an inertial sensor, and the parser that most protocols share.
#pragma once

#include <Eigen/Core>
#include <concepts>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/device_clock.hpp"
#include "drivers/serial/frame_decoder.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

/// What became of a message.
enum class ImuVerdict : std::uint8_t {
  kSample,
  kOther,      ///< a frame without rate or acceleration
  kPartial,    ///< a rate without the acceleration of the same time, or the reverse
  kUnscaled,   ///< raw numbers without a unit
  kSaturated,  ///< at the end of the sensor's range
};

/// In the sensor's axes; acceleration is +9.81 upwards at rest.
struct ImuReading {
  ImuVerdict verdict = ImuVerdict::kOther;
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();
  std::optional<DeviceTime> time = std::nullopt;  ///< of sensors that have a clock
  std::string_view no_sample = {};  ///< the name of a frame without rate and acceleration
};

/// False for values that are not finite or beyond every sensor's range, and for exactly zero
/// acceleration.
[[nodiscard]] inline bool is_plausible(const ImuReading& reading) {
  constexpr double kMostRate = 80.0;           // rad/s
  constexpr double kMostAcceleration = 650.0;  // m/s^2
  return reading.gyro_radps.allFinite() && reading.accel_mps2.allFinite() &&
         reading.gyro_radps.cwiseAbs().maxCoeff() < kMostRate &&
         reading.accel_mps2.cwiseAbs().maxCoeff() < kMostAcceleration &&
         !reading.accel_mps2.isZero(0.0);
}

/// Totals of readings by outcome.
struct ImuCounts {
  std::uint64_t samples = 0;
  std::uint64_t partial = 0;
  std::uint64_t unscaled = 0;
  std::uint64_t saturated = 0;
  std::uint64_t implausible = 0;
  std::uint64_t clock_restarts = 0;  ///< of the sensor's own clock
};

/// Counts `reading` and forwards it to `sink` if it is a sample. The stamp comes from the sensor's
/// clock if it has one.
inline void forward_sample(const ImuReading& reading, Timestamp arrival, DeviceClock& clock,
                           ImuCounts& counts, const std::function<void(const ImuSample&)>& sink) {
  const Timestamp stamp = clock.to_local(reading.time, arrival);
  counts.clock_restarts = clock.restarts();
  if (reading.verdict == ImuVerdict::kOther) return;
  if (reading.verdict == ImuVerdict::kPartial) {
    ++counts.partial;
  } else if (reading.verdict == ImuVerdict::kUnscaled) {
    ++counts.unscaled;
  } else if (reading.verdict == ImuVerdict::kSaturated) {
    ++counts.saturated;
  } else if (!is_plausible(reading)) {
    ++counts.implausible;
  } else {
    ++counts.samples;
    sink({stamp, reading.gyro_radps, reading.accel_mps2});
  }
}

/// One frame is one reading:  `static ImuReading read(Bytes frame)`,  a pure function. `kNoSamples`
/// is the advice when frames arrive without samples.
template <class Protocol>
concept ImuProtocolFormat = FrameProtocol<Protocol> && requires(Bytes frame) {
  { Protocol::read(frame) } -> std::same_as<ImuReading>;
  { Protocol::kNoSamples } -> std::convertible_to<std::string_view>;
};

/// The parser of a protocol whose frames are independent.
template <ImuProtocolFormat Protocol>
class ImuFrameParser {
 public:
  using Measurement = ImuSample;
  static constexpr std::size_t kMaxFrame = Protocol::kMaxFrame;
  static constexpr std::string_view kForeignMeaning = {};

  [[nodiscard]] static FrameCheck examine(Bytes bytes) { return Protocol::examine(bytes); }

  void parse(Bytes frame, Timestamp arrival, const std::function<void(const ImuSample&)>& sink) {
    const ImuReading reading = Protocol::read(frame);
    no_sample_ = reading.no_sample;
    forward_sample(reading, arrival, clock_, counts_, sink);
  }

  [[nodiscard]] std::string no_measurement_reason() const {
    if (no_sample_.empty()) return std::string(Protocol::kNoSamples);
    return "the sensor sends " + std::string(no_sample_) + "; " + std::string(Protocol::kNoSamples);
  }
  [[nodiscard]] const ImuCounts& counts() const { return counts_; }

 private:
  DeviceClock clock_;
  ImuCounts counts_;
  std::string_view no_sample_;  ///< of the last frame
};

}  // namespace crepes
