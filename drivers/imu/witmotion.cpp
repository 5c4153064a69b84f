#include "drivers/imu/witmotion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "drivers/serial/byte_fields.hpp"

namespace crepes {
namespace {

constexpr std::uint8_t kHeader = 0x55;
constexpr std::uint8_t kAcceleration = 0x51;
constexpr std::uint8_t kRate = 0x52;
constexpr double kFullScale = 32768.0;
constexpr double kAccelerationUnit = 16.0 * 9.80665 / kFullScale;             // m/s^2
constexpr double kRateUnit = 2000.0 * std::numbers::pi / 180.0 / kFullScale;  // rad/s
constexpr Duration kWithinSample = std::chrono::milliseconds(5);

using Raw = Eigen::Vector3i;

Raw raw_of(Bytes frame) { return vector_at<std::int16_t>(frame, 2).cast<int>(); }

bool is_saturated(const Raw& raw) { return raw.minCoeff() == -0x8000 || raw.maxCoeff() == 0x7fff; }

void encode(std::span<std::uint8_t> frame, std::uint8_t type, const Eigen::Vector3d& value,
            double unit) {
  constexpr long kCelsius25 = 2500;
  frame[0] = kHeader;
  frame[1] = type;
  for (Eigen::Index i = 0; i < 4; ++i) {
    const long word =
        i < 3 ? std::clamp(std::lround(value[i] / unit), -0x8000L, 0x7fffL) : kCelsius25;
    const auto at = static_cast<std::size_t>(2 + 2 * i);
    frame[at] = static_cast<std::uint8_t>(word & 0xff);
    frame[at + 1] = static_cast<std::uint8_t>(word >> 8 & 0xff);
  }
  frame[10] = byte_sum(frame.first(10));
}

}  // namespace

FrameCheck WitMotionParser::examine(Bytes bytes) {
  if (bytes[0] != kHeader) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (bytes[1] < 0x50 || bytes[1] > 0x5f) return {};
  if (bytes.size() < kMaxFrame) return {FrameKind::kIncomplete};
  if (byte_sum(bytes.first(10)) != bytes[10]) return {FrameKind::kBadChecksum};
  return {FrameKind::kComplete, kMaxFrame};
}

void WitMotionParser::parse(Bytes frame, Timestamp arrival,
                            const std::function<void(const ImuSample&)>& sink) {
  const Raw raw = raw_of(frame);
  if (frame[1] == kAcceleration) {
    acceleration_ = Acceleration{.arrival = arrival,
                                 .mps2 = raw.cast<double>() * kAccelerationUnit,
                                 .saturated = is_saturated(raw)};
    return;
  }
  const std::optional<Acceleration> acceleration = std::exchange(acceleration_, std::nullopt);
  if (frame[1] != kRate) return;
  ImuReading reading{.verdict = ImuVerdict::kPartial, .gyro_radps = raw.cast<double>() * kRateUnit};
  // Both halves are sent at once; an older first half belongs to a sample that lost its second.
  if (acceleration && arrival - acceleration->arrival <= kWithinSample) {
    const bool saturated = acceleration->saturated || is_saturated(raw);
    reading.verdict = saturated ? ImuVerdict::kSaturated : ImuVerdict::kSample;
    reading.accel_mps2 = acceleration->mps2;
  }
  take(reading, arrival, clock_, counts_, sink);
}

std::string WitMotionParser::why_nothing() {
  return "the WitMotion sensor does not send acceleration (51) and rate (52) together; switch both "
         "on with its set-up program";
}

std::array<std::uint8_t, 22> encode_witmotion(const Eigen::Vector3d& gyro_radps,
                                              const Eigen::Vector3d& accel_mps2) {
  std::array<std::uint8_t, 22> bytes{};
  encode(std::span(bytes).first(11), kAcceleration, accel_mps2, kAccelerationUnit);
  encode(std::span(bytes).last(11), kRate, gyro_radps, kRateUnit);
  return bytes;
}

}  // namespace crepes
