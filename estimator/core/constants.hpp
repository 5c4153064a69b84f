/// Constants of nature and of notation, each defined once.
#pragma once

#include <numbers>

namespace crepes {

/// Standard gravity [m/s^2]: the unit g of data sheets.
inline constexpr double kGravityMps2 = 9.80665;
/// Gravity where nobody has measured it [m/s^2]. Recordings of simulated worlds were made with it.
inline constexpr double kNominalGravityMps2 = 9.81;

inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// An angle in degrees, in radians.
[[nodiscard]] constexpr double radians(double degrees) {
  return degrees * std::numbers::pi / 180.0;
}

}  // namespace crepes
