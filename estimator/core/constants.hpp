/// Constants of nature and of notation, each defined once.
#pragma once

#include <numbers>

namespace crepes {

/// Standard gravity [m/s^2].
inline constexpr double kGravityMps2 = 9.80665;

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;
inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// An angle in degrees, in radians.
[[nodiscard]] constexpr double radians(double degrees) {
  return degrees * std::numbers::pi / 180.0;
}

}  // namespace crepes
