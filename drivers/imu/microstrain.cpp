#include "drivers/imu/microstrain.hpp"

#include <optional>

#include "drivers/serial/byte_fields.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr auto kMipOrder = std::endian::big;
constexpr std::size_t kMipSet = 2;
constexpr std::size_t kMipLength = 3;
constexpr std::size_t kMipPayload = 4;
constexpr std::size_t kMipChecksum = 2;
constexpr std::size_t kMipFieldHeader = 2;
constexpr std::uint8_t kSensorData = 0x80;
constexpr std::uint8_t kScaledAccel = 0x04;
constexpr std::uint8_t kScaledGyro = 0x05;
constexpr std::uint8_t kReferenceTime = 0xd5;

/// Two sums modulo 256: of the bytes, and of the first sum after each byte.
std::uint64_t fletcher_of(Bytes bytes) {
  std::uint8_t first = 0;
  std::uint8_t second = 0;
  for (const std::uint8_t byte : bytes) {
    first = static_cast<std::uint8_t>(first + byte);
    second = static_cast<std::uint8_t>(second + first);
  }
  return static_cast<std::uint64_t>(first) << 8U | second;
}

/// Whether the fields fill the payload.
bool fields_fill(Bytes frame) {
  std::size_t at = kMipPayload;
  const std::size_t end = frame.size() - kMipChecksum;
  while (at < end) {
    if (frame[at] < kMipFieldHeader) return false;
    at += frame[at];
  }
  return at == end;
}

}  // namespace

FrameCheck MicroStrain::examine(Bytes bytes) {
  if (bytes[0] != 0x75) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (bytes[1] != 0x65) return {};
  if (bytes.size() < kMipPayload) return {FrameKind::kIncomplete};
  const std::size_t end = kMipPayload + bytes[kMipLength];
  const std::size_t length = end + kMipChecksum;
  if (bytes.size() < length) return {FrameKind::kIncomplete};
  if (fletcher_of(bytes.first(end)) != unsigned_at(bytes, end, kMipChecksum, kMipOrder))
    return {FrameKind::kBadChecksum};
  if (!fields_fill(bytes.first(length))) return {};
  return {FrameKind::kComplete, length};
}

ImuReading MicroStrain::read(Bytes frame) {
  constexpr std::size_t kTriad = 12;
  constexpr std::size_t kTime = 8;
  if (frame[kMipSet] != kSensorData) return {};
  std::optional<Eigen::Vector3d> accel_g;
  std::optional<Eigen::Vector3d> gyro;
  std::optional<DeviceTime> time;
  for (std::size_t at = kMipPayload; at + kMipChecksum < frame.size(); at += frame[at]) {
    const Bytes data = frame.subspan(at + kMipFieldHeader, frame[at] - kMipFieldHeader);
    const std::uint8_t field = frame[at + 1];
    if (field == kScaledAccel && data.size() == kTriad)
      accel_g = vector_at<float>(data, 0, kMipOrder);
    if (field == kScaledGyro && data.size() == kTriad) gyro = vector_at<float>(data, 0, kMipOrder);
    if (field == kReferenceTime && data.size() == kTime)
      time = DeviceTime{.ns = unsigned_at(data, 0, kTime, kMipOrder)};
  }
  if (!accel_g && !gyro) return {};
  if (!accel_g || !gyro) return {.verdict = ImuVerdict::kPartial};
  return {.verdict = ImuVerdict::kSample,
          .gyro_radps = *gyro,
          .accel_mps2 = *accel_g * kGravityMps2,
          .time = time};
}

}  // namespace crepes
