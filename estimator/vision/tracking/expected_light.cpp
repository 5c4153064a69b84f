#include "estimator/vision/tracking/expected_light.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/vision/tracking/light_sighting.hpp"

namespace crepes {
namespace {

constexpr double kMountingSigma = 0.01;      // m
constexpr double kCameraSigma = 0.004;       // rad
constexpr double kSpeedSigma = 0.5;          // m/s
constexpr double kMostExpectedSigma = 0.04;  // rad; less certain, it says little
constexpr double kExpectedReach = 3.0;       // sigmas

}  // namespace

double ExpectedLight::reach_rad() const { return kExpectedReach * sigma_rad; }

std::optional<BoardDirection> direction_of(const ExpectedBoard& board, const Eigen::Vector3d& p_B_C,
                                           Timestamp stamp) {
  const double dt = to_seconds(stamp - board.stamp);
  const Eigen::Vector3d p_C_M = board.p_B_M + dt * board.v_B_M - p_B_C;
  const double distance_m = p_C_M.norm();
  const Eigen::Vector3d u_B = p_C_M / distance_m;
  const double across_m2 = board.covariance_m2.trace() - u_B.dot(board.covariance_m2 * u_B);
  const double sigma_m =
      std::sqrt(across_m2 + kMountingSigma * kMountingSigma + std::pow(kSpeedSigma * dt, 2));
  const double sigma_rad = std::hypot(sigma_m / distance_m, kCameraSigma);
  if (!(sigma_rad < kMostExpectedSigma)) return std::nullopt;
  return BoardDirection{u_B, sigma_rad};
}

const ExpectedLight* find_near(std::span<const ExpectedLight> expected, std::size_t code,
                               const Eigen::Vector3d& seen_B) {
  const auto found = std::ranges::find_if(expected, [&](const ExpectedLight& light) {
    const double reach = kExpectedReach * kMostExpectedSigma;
    return light.match.code == code && squared_chord(light.u_B, seen_B) < reach * reach;
  });
  return found == expected.end() ? nullptr : &*found;
}

}  // namespace crepes
