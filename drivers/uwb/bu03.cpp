#include "drivers/uwb/bu03.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include "drivers/serial/byte_fields.hpp"

namespace crepes {
namespace {

constexpr std::array<std::uint8_t, 3> kBeginning{0xaa, Bu03::kMaxFrame, 0x01};
constexpr std::uint8_t kEnd = 0x55;
constexpr std::size_t kStations = 8;
constexpr std::uint64_t kMostMm = 1000000;  // beyond it the bytes are no distance of this radio

std::uint64_t distance_mm(Bytes frame, std::size_t station) {
  return unsigned_at(frame, kBeginning.size() + 4 * station, 4);
}

}  // namespace

FrameCheck Bu03::examine(Bytes bytes) {
  for (std::size_t i = 0; i < kBeginning.size(); ++i) {
    if (i == bytes.size()) return {FrameKind::kIncomplete};
    if (bytes[i] != kBeginning[i]) return {};
  }
  if (bytes.size() < kMaxFrame) return {FrameKind::kIncomplete};
  const Bytes frame = bytes.first(kMaxFrame);
  if (frame.back() != kEnd) return {};
  for (std::size_t station = 0; station < kStations; ++station) {
    if (distance_mm(frame, station) > kMostMm) return {};
  }
  // A frame that was cut short and the next one.
  const auto again =
      std::search(frame.begin() + 1, frame.end(), kBeginning.begin(), kBeginning.end());
  if (again != frame.end()) return {};
  return {FrameKind::kComplete, kMaxFrame};
}

UwbReading Bu03::read(Bytes frame) {
  UwbReading reading;
  for (std::size_t station = 0; station < kStations; ++station) {
    const std::uint64_t mm = distance_mm(frame, station);
    if (mm == 0) continue;
    reading.distances.push_back(
        {.module = static_cast<std::uint32_t>(station), .range_m = static_cast<double>(mm) * 1e-3});
  }
  return reading;
}

}  // namespace crepes
