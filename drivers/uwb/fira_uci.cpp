#include "drivers/uwb/fira_uci.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "drivers/serial/byte_fields.hpp"

namespace crepes {
namespace {

/// Notification of the session control group, opcode 0.
constexpr std::array<std::uint8_t, 3> kSessionInfo{0x62, 0x00, 0x00};
constexpr std::size_t kUciLength = 3;
constexpr std::size_t kUciKind = 17;
constexpr std::uint8_t kTwoWay = 0x01;
constexpr std::size_t kUciReserved = 18;
constexpr std::size_t kUciAddressing = 19;
constexpr std::uint8_t kExtended = 0x01;
constexpr std::size_t kUciCount = 28;
constexpr std::size_t kUciFirst = 29;
constexpr std::size_t kMeasurement = 31;
constexpr std::uint64_t kNoDistance = 0xffff;

/// Offsets in a measurement behind its address.
constexpr std::size_t kUciStatus = 0;
constexpr std::size_t kUciDistance = 2;

}  // namespace

FrameCheck FiraUci::examine(Bytes bytes) {
  const std::size_t known = std::min(bytes.size(), kSessionInfo.size());
  if (!std::ranges::equal(bytes.first(known), std::span(kSessionInfo).first(known))) return {};
  if (bytes.size() <= kUciLength) return {FrameKind::kIncomplete};
  const std::size_t length = kUciLength + 1 + bytes[kUciLength];
  if (length < kUciFirst) return {};
  if (bytes.size() < kUciFirst) return {FrameKind::kIncomplete};
  if (bytes[kUciKind] != kTwoWay || bytes[kUciReserved] != 0 || bytes[kUciAddressing] > kExtended)
    return {};
  if (kUciFirst + bytes[kUciCount] * kMeasurement > length) return {};  // vendors' data may follow
  if (bytes.size() < length) return {FrameKind::kIncomplete};
  if (begins_twice(bytes.first(length))) return {};  // cut short, and the next one behind it
  return {FrameKind::kComplete, length};
}

UwbReading FiraUci::read(Bytes frame) {
  const std::size_t address_size = frame[kUciAddressing] == kExtended ? 8 : 2;
  UwbReading reading;
  for (std::size_t i = 0; i < frame[kUciCount]; ++i) {
    const Bytes measurement = frame.subspan(kUciFirst + i * kMeasurement, kMeasurement);
    const Bytes result = measurement.subspan(address_size);
    const std::uint64_t distance_cm = unsigned_at(result, kUciDistance, 2);
    if (result[kUciStatus] != 0 || distance_cm == kNoDistance) continue;
    reading.distances.push_back({.module = static_cast<std::uint32_t>(unsigned_at(
                                     measurement, 0, std::min<std::size_t>(address_size, 4))),
                                 .range_m = static_cast<double>(distance_cm) * 1e-2});
  }
  return reading;
}

}  // namespace crepes
