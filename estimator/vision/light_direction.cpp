#include "estimator/vision/light_direction.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr double kRateSigma = 1.0;     // of a light seen for the first time [rad/s]
constexpr double kAccelDensity = 3.0;  // [rad/s^2/sqrt(Hz)]
constexpr double kGyroSigma = 0.02;    // what the gyro leaves of own rotation [rad/s]
constexpr int kScatterMemory = 100;    // spots
constexpr int kKnownScatter = 10;      // spots that the configured sigma counts for
constexpr double kMostScatter = 9.0;   // times what is expected; beyond, it is another light

double square(double x) { return x * x; }

}  // namespace

LightDirection LightDirection::at(const Eigen::Vector3d& u_B, double px_rad, double sigma_px) {
  const double scatter_px2 = square(sigma_px);
  return {.u_B = u_B,
          .variance = scatter_px2 * square(px_rad),
          .rate_variance = kRateSigma * kRateSigma,
          .scatter_px2 = scatter_px2};
}

/// u <- R_B1_B0 (u + rate dt), with a white acceleration of density kAccelDensity.
void LightDirection::predict(const Eigen::Quaterniond& R_now_before, double dt_s) {
  constexpr double kQ = kAccelDensity * kAccelDensity;
  u_B = (R_now_before * (u_B + rate_B * dt_s)).normalized();
  rate_B = R_now_before * rate_B;
  variance += dt_s * (2.0 * covariance + dt_s * rate_variance) + kQ * dt_s * dt_s * dt_s / 3.0 +
              std::pow(kGyroSigma * dt_s, 2);
  covariance += dt_s * rate_variance + kQ * dt_s * dt_s / 2.0;
  rate_variance += kQ * dt_s;
}

void LightDirection::correct(const Eigen::Vector3d& spot_B, double px_rad, double least_px,
                             int hits) {
  const double S = variance + square(sigma_px(least_px) * px_rad);
  const double gain = variance / S;
  const double rate_gain = covariance / S;
  const Eigen::Vector3d residual = spot_B - u_B;

  // The scatter is what the prediction does not explain.
  const double shown_px2 = (0.5 * residual.squaredNorm() - variance) / square(px_rad);
  const double credible_px2 = std::clamp(shown_px2, 0.0, kMostScatter * square(sigma_px(least_px)));
  scatter_px2 += (credible_px2 - scatter_px2) / std::min(kKnownScatter + hits, kScatterMemory);

  u_B = (u_B + gain * residual).normalized();
  rate_B += rate_gain * residual;
  rate_B -= u_B * u_B.dot(rate_B);
  rate_variance -= rate_gain * covariance;
  covariance *= 1.0 - gain;
  variance *= 1.0 - gain;
}

double LightDirection::sigma_px(double least_px) const {
  return std::max(least_px, std::sqrt(scatter_px2));
}

}  // namespace crepes
