#include "estimator/vision/hidden_lights.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace crepes {
namespace {

constexpr double kFirstSigma = 0.01;  // of the expected direction, when it is hidden [rad]
constexpr double kWander = 0.1;       // and what is added a second [rad/s]: maneuvers
constexpr double kReachSigmas = 2.5;
constexpr double kStrangers = 0.1;                 // so many of the lights that appear are others
constexpr double kField = 2.0 * std::numbers::pi;  // where they may appear [sr]
constexpr double kLeastStranger = 1e-3;            // what hides one light may show another
constexpr double kMostStranger = 0.3;              // beyond it nothing is continued

double sigma_of(const HiddenLight& light, Timestamp now) {
  return kFirstSigma + kWander * to_seconds(now - light.last_seen);
}

/// Squared distance from the expected direction, in sigmas.
double distance2_of(const HiddenLight& light, const Eigen::Vector3d& u_B, Timestamp now) {
  const Eigen::Vector3d expected =
      (light.u_B + to_seconds(now - light.last_seen) * light.rate_B).normalized();
  const double sigma = sigma_of(light, now);
  return (expected - u_B).squaredNorm() / (sigma * sigma);
}

/// The density of its direction at `u_B`, per steradian; zero beyond the gate.
double density_of(const HiddenLight& light, const Eigen::Vector3d& u_B, Timestamp now) {
  const double sigma = sigma_of(light, now);
  const double distance2 = distance2_of(light, u_B, now);
  if (distance2 > kReachSigmas * kReachSigmas) return 0.0;
  return std::exp(-0.5 * distance2) / (2.0 * std::numbers::pi * sigma * sigma);
}

}  // namespace

void HiddenLights::rotate_frame(const Eigen::Quaterniond& R_now_before) {
  for (HiddenLight& light : lights_) {
    light.u_B = R_now_before * light.u_B;
    light.rate_B = R_now_before * light.rate_B;
  }
}

void HiddenLights::drop_old(Timestamp now, std::vector<BlinkEvidence>& unused) {
  std::erase_if(lights_, [&](HiddenLight& light) {
    if (now - light.last_seen <= kLongest) return false;
    light.evidence.forget();
    unused.push_back(std::move(light.evidence));
    return true;
  });
}

void HiddenLights::add(HiddenLight light, std::vector<BlinkEvidence>& unused) {
  if (lights_.size() == kCapacity) {
    const auto oldest = std::min_element(
        lights_.begin(), lights_.end(),
        [](const HiddenLight& a, const HiddenLight& b) { return a.last_seen < b.last_seen; });
    oldest->evidence.forget();
    unused.push_back(std::move(oldest->evidence));
    lights_.erase(oldest);
  }
  lights_.push_back(std::move(light));
}

/// Bayes:  p(light) = p / (n + sum p),  p the densities of hidden lights, n that of others.
std::optional<HiddenLights::Return> HiddenLights::extract_match(const Eigen::Vector3d& u_B,
                                                                Timestamp now) {
  double sum = kStrangers / kField;
  double most = 0.0;
  auto likeliest = lights_.end();
  for (auto it = lights_.begin(); it != lights_.end(); ++it) {
    const double density = density_of(*it, u_B, now);
    sum += density;
    if (density <= most) continue;
    most = density;
    likeliest = it;
  }
  if (likeliest == lights_.end() || most < (1.0 - kMostStranger) * sum) return std::nullopt;
  Return found{std::move(likeliest->evidence), std::max(kLeastStranger, 1.0 - most / sum)};
  lights_.erase(likeliest);
  return found;
}

}  // namespace crepes
