#include "drivers/imu/xsens.hpp"

#include <algorithm>
#include <chrono>
#include <optional>

#include "drivers/serial/byte_fields.hpp"

namespace crepes {
namespace {

constexpr std::uint8_t kMtData2 = 0x36;
constexpr std::size_t kItemHeader = 3;
constexpr std::uint32_t kSampleTimeFine = 0x1060;
constexpr std::uint32_t kAccelerationId = 0x4020;
constexpr std::uint32_t kRateOfTurn = 0x8020;
constexpr std::uint32_t kStatusWord = 0xe020;
constexpr std::uint32_t kClipped = 0x3f00;  ///< of the status: any axis of either sensor

/// Position of the payload: a length of ff is followed by an extended length.
struct Extent {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Empty: too few bytes.
std::optional<Extent> extent_of(Bytes bytes) {
  if (bytes.size() < 4) return std::nullopt;
  if (bytes[3] != 0xff) return Extent{4, std::size_t{4} + bytes[3]};
  if (bytes.size() < 6) return std::nullopt;
  return Extent{6, 6 + unsigned_at(bytes, 4, 2, std::endian::big)};
}

/// Whether the items received so far can fill the payload.
bool items_can_fill(Bytes bytes, Extent payload) {
  std::size_t at = payload.begin;
  while (at + kItemHeader <= std::min(bytes.size(), payload.end)) at += kItemHeader + bytes[at + 2];
  const bool another_fits = at + kItemHeader <= payload.end;
  return at == payload.end || (another_fits && at + kItemHeader > bytes.size());
}

/// Three numbers in the format given by the low two bits of the item's id.
std::optional<Eigen::Vector3d> triad(Bytes data, std::uint32_t format) {
  constexpr auto kBig = std::endian::big;
  if (format == 0 && data.size() == 12) return vector_at<float>(data, 0, kBig);
  if (format == 3 && data.size() == 24) return vector_at<double>(data, 0, kBig);
  if (format == 1 && data.size() == 12)  // 12.20
    return vector_at<std::int32_t>(data, 0, kBig) / static_cast<double>(1U << 20U);
  if (format != 2 || data.size() != 18) return std::nullopt;
  const auto fixed = [&](std::size_t at) {  // 16.32, fraction first
    return static_cast<double>(field_at<std::int16_t>(data, at + 4, kBig)) +
           static_cast<double>(field_at<std::uint32_t>(data, at, kBig)) / 4294967296.0;
  };
  return Eigen::Vector3d(fixed(0), fixed(6), fixed(12));
}

}  // namespace

FrameCheck Xsens::examine(Bytes bytes) {
  if (bytes[0] != 0xfa) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (bytes[1] != 0xff && bytes[1] != 0x01)
    return {};  // the sensor itself, or the first on its bus
  const std::optional<Extent> payload = extent_of(bytes);
  if (!payload) return {FrameKind::kIncomplete};
  const std::size_t length = payload->end + 1;
  if (length > kMaxFrame) return {};
  if (bytes[2] == kMtData2 && !items_can_fill(bytes, *payload)) return {};
  if (bytes.size() < length) return {FrameKind::kIncomplete};
  if (byte_sum(bytes.subspan(1, length - 1)) != 0) return {FrameKind::kBadChecksum};
  if (begins_twice(bytes.first(length))) return {};
  return {FrameKind::kComplete, length};
}

ImuReading Xsens::read(Bytes frame) {
  if (frame[2] != kMtData2) return {};
  const Extent payload = extent_of(frame).value_or(Extent{});
  std::optional<Eigen::Vector3d> accel;
  std::optional<Eigen::Vector3d> gyro;
  std::optional<DeviceTime> time;
  bool clipped = false;
  for (std::size_t at = payload.begin; at < payload.end;) {
    const auto id = static_cast<std::uint32_t>(unsigned_at(frame, at, 2, std::endian::big));
    const Bytes data = frame.subspan(at + kItemHeader, frame[at + 2]);
    if (id == kSampleTimeFine && data.size() == 4) {
      time = DeviceTime::ticks(unsigned_at(data, 0, 4, std::endian::big),
                               std::chrono::microseconds{100}, 32);
    }
    // Bits 2 and 3 select the axes of orientations; these two items are always in sensor axes.
    if ((id & 0xfff0U) == kAccelerationId) accel = triad(data, id & 3U);
    if ((id & 0xfff0U) == kRateOfTurn) gyro = triad(data, id & 3U);
    if (id == kStatusWord && data.size() == 4)
      clipped = (field_at<std::uint32_t>(data, 0, std::endian::big) & kClipped) != 0;
    at += kItemHeader + data.size();
  }
  if (!accel && !gyro) return {};
  if (!accel || !gyro) return {.verdict = ImuVerdict::kPartial};
  return {.verdict = clipped ? ImuVerdict::kSaturated : ImuVerdict::kSample,
          .gyro_radps = *gyro,
          .accel_mps2 = *accel,
          .time = time};
}

}  // namespace crepes
