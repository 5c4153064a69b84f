#include "drivers/imu/witmotion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

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

Raw raw_of(Bytes frame) {
  const auto word = [&](std::size_t at) {
    const int value = frame[at] | frame[at + 1] << 8;
    return value >= 0x8000 ? value - 0x10000 : value;
  };
  return {word(2), word(4), word(6)};
}

bool is_saturated(const Raw& raw) { return raw.minCoeff() == -0x8000 || raw.maxCoeff() == 0x7fff; }

std::uint8_t checksum_of(Bytes bytes) {
  return static_cast<std::uint8_t>(std::accumulate(bytes.begin(), bytes.end(), 0U));
}

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
  frame[10] = checksum_of(frame.first(10));
}

}  // namespace

FrameCheck WitMotionParser::examine(Bytes bytes) {
  if (bytes[0] != kHeader) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (bytes[1] < 0x50 || bytes[1] > 0x5f) return {};
  if (bytes.size() < kMaxFrame) return {FrameKind::kIncomplete};
  if (checksum_of(bytes.first(10)) != bytes[10]) return {FrameKind::kBadChecksum};
  return {FrameKind::kComplete, kMaxFrame};
}

void WitMotionParser::parse(Bytes frame, Timestamp arrival,
                            const std::function<void(const ImuSample&)>& sink) {
  const Raw raw = raw_of(frame);
  if (frame[1] == kAcceleration) {
    acceleration_ = Acceleration{.arrival = arrival,
                                 .mps2 = raw.cast<double>() * kAccelerationUnit,
                                 .plausible = !is_saturated(raw) && !raw.isZero()};
    return;
  }
  const std::optional<Acceleration> acceleration = std::exchange(acceleration_, std::nullopt);
  if (frame[1] != kRate) return;
  // Both halves are sent at once; an older first half belongs to a sample that lost its second.
  if (!acceleration || arrival - acceleration->arrival > kWithinSample) {
    ++counts_.incomplete;
  } else if (!acceleration->plausible || is_saturated(raw)) {
    ++counts_.implausible;
  } else {
    ++counts_.samples;
    sink({.stamp = arrival,
          .gyro_radps = raw.cast<double>() * kRateUnit,
          .accel_mps2 = acceleration->mps2});
  }
}

std::array<std::uint8_t, 22> encode_witmotion(const Eigen::Vector3d& gyro_radps,
                                              const Eigen::Vector3d& accel_mps2) {
  std::array<std::uint8_t, 22> bytes{};
  encode(std::span(bytes).first(11), kAcceleration, accel_mps2, kAccelerationUnit);
  encode(std::span(bytes).last(11), kRate, gyro_radps, kRateUnit);
  return bytes;
}

}  // namespace crepes
