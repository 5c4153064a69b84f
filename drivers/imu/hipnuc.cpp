#include "drivers/imu/hipnuc.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/serial/byte_fields.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr std::size_t kPayload = 6;
constexpr std::size_t kHi91Length = 76;
constexpr std::uint8_t kHi91 = 0x91;
constexpr double kHi91G = 9.8;  // m/s^2; the firmware divides by it, not by standard gravity
constexpr std::size_t kHi81NeededLength = 24;  // what follows differs between firmwares
constexpr std::uint8_t kHi81 = 0x81;
constexpr double kHi81GyroStep = 1e-3;            // rad/s
constexpr double kHi81AccelStep = 10.0 / 2048.0;  // m/s^2

constexpr std::uint8_t kHi83 = 0x83;
constexpr std::size_t kHi83Fields = 8;  // where they begin
constexpr unsigned kAccelerationBit = 0;
constexpr unsigned kRateBit = 1;
constexpr unsigned kTimeBit = 5;
constexpr std::uint64_t kSaturatedBits = 0x60;  // of the status: accelerometer, gyroscope

/// Bytes of each field of HI83 by its bit; 0: not published, and of unknown size.
constexpr std::array<std::size_t, 32> kHi83Sizes{12, 12, 12, 12, 16, 8, 8, 4, 4,  12, 12,
                                                 12, 12, 12, 24, 4,  4, 4, 4, 4,  0,  0,
                                                 0,  0,  0,  0,  0,  0, 0, 0, 24, 12};

ImuReading read_hi91(Bytes payload) {
  return {.verdict = ImuVerdict::kSample,
          .gyro_radps = vector_at<float>(payload, 24) * radians(1.0),
          .accel_mps2 = vector_at<float>(payload, 12) * kHi91G,
          .time = DeviceTime::ticks(unsigned_at(payload, 8, 4), std::chrono::milliseconds{1}, 32)};
}

/// Its only clock is that of GNSS, which may have no reception.
ImuReading read_hi81(Bytes payload) {
  return {.verdict = ImuVerdict::kSample,
          .gyro_radps = vector_at<std::int16_t>(payload, 12) * kHi81GyroStep,
          .accel_mps2 = vector_at<std::int16_t>(payload, 18) * kHi81AccelStep,
          .time = {}};
}

/// The length of an HI83 whose bitmap's bits below `end` are set; empty if one is not published.
std::optional<std::size_t> hi83_length(std::uint64_t bitmap, unsigned end) {
  std::size_t length = kHi83Fields;
  for (unsigned bit = 0; bit < end; ++bit) {
    if ((bitmap >> bit & 1U) == 0) continue;
    if (kHi83Sizes[bit] == 0) return std::nullopt;
    length += kHi83Sizes[bit];
  }
  return length;
}

/// Fields follow in the order of their bits. Early firmware has a time of four bytes: its length
/// differs, and the maker's own decoder refuses it, too.
ImuReading read_hi83(Bytes payload) {
  if (payload.size() < kHi83Fields) return {.no_sample = "HI83 that is cut short"};
  const std::uint64_t bitmap = unsigned_at(payload, 4, 4);
  const std::optional<std::size_t> length = hi83_length(bitmap, kHi83Sizes.size());
  if (!length) return {.no_sample = "HI83 with fields that are not published (bits 20 to 29)"};
  if (*length != payload.size())
    return {.no_sample = "HI83 of another length than its bitmap's, as early firmware 1.7.1 does"};
  const auto has = [&](unsigned bit) { return (bitmap >> bit & 1U) != 0; };
  if (!has(kAccelerationBit) && !has(kRateBit))
    return {.no_sample = "HI83 without acc_b and gyr_b"};
  if (!has(kAccelerationBit) || !has(kRateBit))
    return {.verdict = ImuVerdict::kPartial, .no_sample = "HI83 without one of acc_b and gyr_b"};
  std::optional<DeviceTime> time;
  if (has(kTimeBit)) {
    const std::size_t at = *hi83_length(bitmap, kTimeBit);
    time = DeviceTime{unsigned_at(payload, at, 8) * 1000};
  }
  const bool is_saturated = (unsigned_at(payload, 1, 2) & kSaturatedBits) != 0;
  return {.verdict = is_saturated ? ImuVerdict::kSaturated : ImuVerdict::kSample,
          .gyro_radps = vector_at<float>(payload, kHi83Fields + kHi83Sizes[kAccelerationBit]),
          .accel_mps2 = vector_at<float>(payload, kHi83Fields),
          .time = time};
}

/// What has no sample, by name. HI92 is an integer packet whose fields differ between firmwares.
std::string_view name_of_other(std::uint8_t tag) {
  if (tag == kHi91) return "HI91 of another length than 76 bytes";
  if (tag == kHi81) return "HI81 that is cut short";
  if (tag == 0x92) return "HI92, whose layout differs between firmwares";
  if (tag == 0x62) return "packets of a wireless receiver (0x62)";
  if (tag == 0x90 || (tag >= 0xa0 && tag <= 0xf0)) return "the old items of HI226 and HI229";
  return "a packet that is not known here";
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
  if (crc16(payload, crc16(bytes.first(4))) != unsigned_at(bytes, 4, 2))
    return {FrameKind::kBadChecksum};
  return {FrameKind::kComplete, length};
}

ImuReading Hipnuc::read(Bytes frame) {
  const Bytes payload = frame.subspan(kPayload);
  if (payload[0] == kHi91 && payload.size() == kHi91Length) return read_hi91(payload);
  if (payload[0] == kHi81 && payload.size() >= kHi81NeededLength) return read_hi81(payload);
  if (payload[0] == kHi83) return read_hi83(payload);
  return {.no_sample = name_of_other(payload[0])};
}

}  // namespace crepes
