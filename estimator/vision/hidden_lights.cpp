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

/// The density of a direction at `u_B`, per steradian; zero beyond the gate.
double density_at(const Eigen::Vector3d& u_B, const Eigen::Vector3d& expected, double sigma) {
  const double distance2 = (expected - u_B).squaredNorm() / (sigma * sigma);
  if (distance2 > kReachSigmas * kReachSigmas) return 0.0;
  return std::exp(-0.5 * distance2) / (2.0 * std::numbers::pi * sigma * sigma);
}

double density_of(const HiddenLight& light, const Eigen::Vector3d& u_B, Timestamp now) {
  const Eigen::Vector3d expected =
      (light.u_B + to_seconds(now - light.last_seen) * light.rate_B).normalized();
  return density_at(u_B, expected, sigma_of(light, now));
}

bool is_of(const HiddenLight& hidden, const ExpectedLight& expected) {
  const BlinkEvidence& evidence = hidden.evidence;
  return (evidence.assigned ? evidence.assigned->code : evidence.expected) == expected.match.code;
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
std::optional<HiddenLights::Return> HiddenLights::extract_match(
    const Eigen::Vector3d& u_B, Timestamp now, std::span<const ExpectedLight> expected) {
  double sum = kStrangers / kField;
  double most = 0.0;
  const auto is_most = [&](double density) {
    sum += density;
    if (density <= most) return false;
    most = density;
    return true;
  };
  auto likeliest = lights_.end();
  for (auto it = lights_.begin(); it != lights_.end(); ++it) {
    const bool has_pose = std::ranges::any_of(
        expected, [&](const ExpectedLight& light) { return is_of(*it, light); });
    if (!has_pose && is_most(density_of(*it, u_B, now))) likeliest = it;
  }
  const ExpectedLight* by_pose = nullptr;
  for (const ExpectedLight& light : expected)
    if (is_most(density_at(u_B, light.u_B, light.sigma_rad))) by_pose = &light;
  if (most == 0.0 || most < (1.0 - kMostStranger) * sum) return std::nullopt;
  if (by_pose != nullptr) {
    likeliest = std::ranges::find_if(
        lights_, [&](const HiddenLight& light) { return is_of(light, *by_pose); });
  }
  Return found{
      .evidence = {}, .stranger = std::max(kLeastStranger, 1.0 - most / sum), .by_pose = by_pose};
  if (likeliest != lights_.end()) {
    found.evidence = std::move(likeliest->evidence);
    lights_.erase(likeliest);
  }
  return found;
}

}  // namespace crepes
