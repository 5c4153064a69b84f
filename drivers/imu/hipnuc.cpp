#include "drivers/imu/hipnuc.hpp"

#include <chrono>
#include <cstdint>

#include "drivers/serial/byte_fields.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr std::size_t kPayload = 6;
constexpr std::size_t kHi91Length = 76;
constexpr std::uint8_t kHi91 = 0x91;
constexpr std::size_t kHi81NeededLength = 24;  // what follows differs between firmwares
constexpr std::uint8_t kHi81 = 0x81;
constexpr double kHi81GyroStep = 1e-3;            // rad/s
constexpr double kHi81AccelStep = 10.0 / 2048.0;  // m/s^2

/// CRC-16 with polynomial 0x1021, most significant bit first, initial value 0.
std::uint16_t crc_of(Bytes bytes, std::uint16_t crc) {
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ byte << 8U);
    for (int bit = 0; bit < 8; ++bit) {
      const unsigned shifted = static_cast<unsigned>(crc) << 1U;
      crc = static_cast<std::uint16_t>((crc & 0x8000U) != 0 ? shifted ^ 0x1021U : shifted);
    }
  }
  return crc;
}

ImuReading read_hi91(Bytes payload) {
  return {.verdict = ImuVerdict::kSample,
          .gyro_radps = vector_at<float>(payload, 24) * radians(1.0),
          .accel_mps2 = vector_at<float>(payload, 12) * kGravityMps2,
          .time = DeviceTime::ticks(unsigned_at(payload, 8, 4), std::chrono::milliseconds{1}, 32)};
}

/// Its only clock is that of GNSS, which may have no reception.
ImuReading read_hi81(Bytes payload) {
  return {.verdict = ImuVerdict::kSample,
          .gyro_radps = vector_at<std::int16_t>(payload, 12) * kHi81GyroStep,
          .accel_mps2 = vector_at<std::int16_t>(payload, 18) * kHi81AccelStep,
          .time = {}};
}

}  // namespace

FrameCheck Hipnuc::examine(Bytes bytes) {
  if (bytes[0] != 0x5a) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (bytes[1] != 0xa5) return {};
  if (bytes.size() < kPayload) return {FrameKind::kIncomplete};
  const std::size_t length = kPayload + unsigned_at(bytes, 2, 2);
  if (length == kPayload || length > kMaxFrame) return {};
  if (bytes.size() < length) return {FrameKind::kIncomplete};
  const Bytes payload = bytes.subspan(kPayload, length - kPayload);
  if (crc_of(payload, crc_of(bytes.first(4), 0)) != unsigned_at(bytes, 4, 2))
    return {FrameKind::kBadChecksum};
  return {FrameKind::kComplete, length};
}

ImuReading Hipnuc::read(Bytes frame) {
  const Bytes payload = frame.subspan(kPayload);
  if (payload[0] == kHi91 && payload.size() == kHi91Length) return read_hi91(payload);
  if (payload[0] == kHi81 && payload.size() >= kHi81NeededLength) return read_hi81(payload);
  return {};
}

}  // namespace crepes
