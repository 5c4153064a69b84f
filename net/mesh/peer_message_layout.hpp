/// Sizes, limits and ticks of the datagram: shared by encoder and decoder.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "estimator/core/measurements.hpp"
#include "net/mesh/wire_codes.hpp"

namespace crepes::wire {

inline constexpr std::array<std::uint8_t, 3> kMagic{'C', 'R', 'P'};
inline constexpr std::uint8_t kVersion = 2;
inline constexpr std::size_t kChecksum = 4;
inline constexpr std::int64_t kTick = 10'000;  // ns
inline constexpr std::int64_t kMaxStamp = 4'000'000'000'000'000'000;

// Ages are in ticks.
inline constexpr std::int64_t kMaxAge = 100'000;        // of measurements and estimates
inline constexpr std::int64_t kMaxReportAge = 200'000;  // of a report when it leaves
inline constexpr std::int64_t kMaxTiltAge = 1'000'000'000;
inline constexpr std::int64_t kMaxAhead = 10'000;  // of stamps, whose clock is one

inline constexpr unsigned kDirectionBits = 15;
inline constexpr unsigned kBearingSigmaBits = 7;
inline constexpr LogScale kBearingSigma{1e-5, 1.0, 127};
inline constexpr unsigned kTiltSigmaBits = 6;
inline constexpr LogScale kTiltSigma{1e-5, 3.2, 63};
inline constexpr double kUnknownTiltSigma = 3.2;  // rad: half a turn, tilt unknown

inline constexpr double kMaxRange = 1e4;  // m
inline constexpr std::int64_t kMaxRangeMm = 10'000'000;
inline constexpr std::int64_t kMaxPower = 255;      // -0.5 dBm
inline constexpr double kMaxCoordinate = 1e5;       // m, m/s
inline constexpr double kCameraStep = 1.0 / 32768;  // m
inline constexpr double kPlaceStep = 1e-4;          // m
inline constexpr double kSpeedStep = 1e-3;          // m/s
inline constexpr std::int64_t kMaxCoordinateCode = 4'000'000'000;

inline constexpr int kMinExponent = -30;  // of the steps of inertial samples, powers of two
inline constexpr int kMaxExponent = 20;
inline constexpr std::int64_t kMaxImuCode = 1 << 22;

inline constexpr unsigned kQuaternionBits = 15;
inline constexpr std::int64_t kQuaternionUnit = 16383;  // of 1/sqrt(2)
inline constexpr unsigned kSigmaBits = 12;
inline constexpr unsigned kFactorBits = 12;
inline constexpr std::uint64_t kMaxEchoAgeUs = 0xFFFF'FFFF;
inline constexpr unsigned kMarkBits = 3;
inline constexpr unsigned kLossBits = 4;
inline constexpr double kLossSteps = 30.0;  // of a loss of 1
inline constexpr std::uint64_t kMaxId = 65534;

/// Rounds down to a whole tick.
[[nodiscard]] inline std::int64_t floor_to_ticks(std::int64_t ns) {
  return ns / kTick - (ns % kTick < 0 ? 1 : 0);
}

/// Whether it is the id of a robot.
[[nodiscard]] inline bool is_robot(RobotId id) { return id.value >= 1 && id.value <= kMaxId; }

}  // namespace crepes::wire
