/// Sizes, limits and ticks of the datagram: shared by encoder and decoder.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "estimator/core/measurements.hpp"
#include "net/mesh/wire_codes.hpp"

namespace crepes::wire {

inline constexpr std::array<std::uint8_t, 3> kMagic{'C', 'R', 'P'};
inline constexpr std::uint8_t kVersion = 1;
inline constexpr std::size_t kChecksum = 4;
inline constexpr std::int64_t kTick = 10'000;  // ns
inline constexpr std::int64_t kMaxStamp = 4'000'000'000'000'000'000;

inline constexpr std::size_t kEchoSize = 14;
inline constexpr std::size_t kImuSize = 14;
inline constexpr std::size_t kCameraSize = 12;
inline constexpr std::size_t kSourceSize = 3;
inline constexpr std::size_t kBearingSize = 8;
inline constexpr std::size_t kRangeSize = 10;
inline constexpr std::size_t kEstimateSize = 78;

inline constexpr LogScale kBearingSigma{1e-5, 1.0, 255};
inline constexpr double kMaxRange = 1e4;          // m
inline constexpr double kMaxCoordinate = 1e6;     // m, m/s
inline constexpr double kUnknownTiltSigma = 3.2;  // rad: half a turn, tilt unknown
inline constexpr int kMinExponent = -30;
inline constexpr int kMaxExponent = 20;
inline constexpr double kMaxCode = 32767.0;

/// The neighbor that was seen, and the sender's camera that saw it.
struct Source {
  RobotId neighbor;
  std::uint8_t camera;
  bool operator==(const Source&) const = default;
};

[[nodiscard]] inline std::int64_t floor_to_ticks(std::int64_t ns) {
  return ns / kTick - (ns % kTick < 0 ? 1 : 0);
}

[[nodiscard]] inline bool is_robot(RobotId id) { return id.value >= 1 && id.value <= 65534; }

}  // namespace crepes::wire
