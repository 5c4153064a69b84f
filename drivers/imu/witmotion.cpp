#include "drivers/imu/witmotion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/serial/byte_fields.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr std::uint8_t kWitMotionHeader = 0x55;
constexpr std::uint8_t kAccelerationFrame = 0x51;
constexpr std::uint8_t kRateFrame = 0x52;
constexpr std::size_t kOne = WitMotion::kMaxFrame / 2;
constexpr double kFullScale = 32768.0;
constexpr double kAccelerationUnit = 16.0 * kGravityMps2 / kFullScale;  // m/s^2
constexpr double kRateUnit = radians(2000.0) / kFullScale;              // rad/s

using Raw = Eigen::Vector3i;

Raw raw_of(Bytes frame, std::size_t at = 2) {
  return vector_at<std::int16_t>(frame, at).cast<int>();
}

bool is_saturated(const Raw& raw) { return raw.minCoeff() == -0x8000 || raw.maxCoeff() == 0x7fff; }

void encode(std::span<std::uint8_t> frame, std::uint8_t type, const Eigen::Vector3d& value,
            double unit) {
  constexpr long kCelsius25 = 2500;
  frame[0] = kWitMotionHeader;
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

/// Whether a sample begins inside the frame. Then the frame is truncated and its checksum is valid
/// by chance (one in 256).
bool begins_inside(Bytes frame) {
  constexpr std::array<std::uint8_t, 2> kBeginning{kWitMotionHeader, kAccelerationFrame};
  return std::search(frame.begin() + 1, frame.end(), kBeginning.begin(), kBeginning.end()) !=
         frame.end();
}

FrameCheck examine_one(Bytes bytes) {
  if (bytes[0] != kWitMotionHeader) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (bytes[1] < 0x50 || bytes[1] > 0x5f) return {};
  if (bytes.size() < kOne) return {FrameKind::kIncomplete};
  if (byte_sum(bytes.first(kOne - 1)) != bytes[kOne - 1]) return {FrameKind::kBadChecksum};
  if (begins_inside(bytes.first(kOne))) return {};
  return {FrameKind::kComplete, kOne};
}

ImuReading reading_of(const Raw& accel, const Raw& gyro) {
  const bool saturated = is_saturated(accel) || is_saturated(gyro);
  return {.verdict = saturated ? ImuVerdict::kSaturated : ImuVerdict::kSample,
          .gyro_radps = gyro.cast<double>() * kRateUnit,
          .accel_mps2 = accel.cast<double>() * kAccelerationUnit};
}

constexpr std::uint8_t kBlePacket = 0x61;
constexpr std::uint8_t kBleAnswer = 0x71;

bool is_ble_beginning(std::uint8_t first, std::uint8_t second) {
  return first == kWitMotionHeader && (second == kBlePacket || second == kBleAnswer);
}

}  // namespace

FrameCheck WitMotion::examine(Bytes bytes) {
  const FrameCheck first = examine_one(bytes);
  if (first.kind != FrameKind::kComplete || bytes[1] != kAccelerationFrame) return first;
  const Bytes rest = bytes.subspan(kOne);
  constexpr std::array<std::uint8_t, 2> kBeginning{kWitMotionHeader, kRateFrame};
  const std::size_t known = std::min(rest.size(), kBeginning.size());
  if (!std::ranges::equal(rest.first(known), std::span(kBeginning).first(known))) return first;
  if (rest.size() < kOne) return {FrameKind::kIncomplete};
  if (examine_one(rest).kind != FrameKind::kComplete) return first;
  return {FrameKind::kComplete, kMaxFrame};
}

ImuReading WitMotion::read(Bytes frame) {
  const bool is_half = frame[1] == kAccelerationFrame || frame[1] == kRateFrame;
  if (frame.size() < kMaxFrame)
    return {.verdict = is_half ? ImuVerdict::kPartial : ImuVerdict::kOther};
  return reading_of(raw_of(frame), raw_of(frame.subspan(kOne)));
}

FrameCheck WitMotionBle::examine(Bytes bytes) {
  constexpr std::size_t kLength = kMaxFrame - 1;
  if (bytes[0] != kWitMotionHeader) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (!is_ble_beginning(bytes[0], bytes[1])) return {};
  // A packet that begins early means that the end of this one is missing.
  const std::size_t known = std::min(bytes.size(), kMaxFrame);
  for (std::size_t at = 2; at + 1 < known; ++at) {
    if (is_ble_beginning(bytes[at], bytes[at + 1])) return {};
  }
  if (bytes.size() < kLength) return {FrameKind::kIncomplete};
  const bool may_begin_another = bytes[kLength - 1] == kWitMotionHeader;
  if (may_begin_another && bytes.size() == kLength) return {FrameKind::kIncomplete};
  return {FrameKind::kComplete, kLength};
}

ImuReading WitMotionBle::read(Bytes frame) {
  constexpr std::size_t kBleRate = 8;
  if (frame[1] != kBlePacket) return {};
  return reading_of(raw_of(frame), raw_of(frame, kBleRate));
}

std::array<std::uint8_t, 22> encode_witmotion(const Eigen::Vector3d& gyro_radps,
                                              const Eigen::Vector3d& accel_mps2) {
  std::array<std::uint8_t, 22> bytes{};
  encode(std::span(bytes).first(11), kAccelerationFrame, accel_mps2, kAccelerationUnit);
  encode(std::span(bytes).last(11), kRateFrame, gyro_radps, kRateUnit);
  return bytes;
}

}  // namespace crepes
