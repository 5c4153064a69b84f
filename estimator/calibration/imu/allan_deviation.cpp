#include "estimator/calibration/imu/allan_deviation.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace crepes {
namespace {

constexpr std::size_t kLeastClusters = 5;
constexpr int kTerms = 3;
constexpr int kReweighted = 3;  // times
// Points share their readings, so all of them say less than if each said something of its own.
// Simulated hours with walks from none to ten times the default: 8 fits both N and K.
constexpr double kShared = 8.0;

/// sigma^2(m) = < (theta_{k+2m} - 2 theta_{k+m} + theta_k)^2 > / (2 tau^2), theta the sum of the
/// readings times the period.
double allan_variance(const std::vector<double>& theta, std::size_t m, double tau_s) {
  double sum = 0.0;
  const std::size_t count = theta.size() - 2 * m;
  for (std::size_t k = 0; k < count; ++k) {
    const double d = theta[k + 2 * m] - 2.0 * theta[k + m] + theta[k];
    sum += d * d;
  }
  return sum / (2.0 * tau_s * tau_s * static_cast<double>(count));
}

struct NormalEquations {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
};

/// sigma^2 at `tau_s`, for each of the terms.
Eigen::Vector3d terms_at(double tau_s) { return {1.0 / tau_s, 1.0, tau_s / 3.0}; }

/// The relative variance of sigma^2 at each point is the inverse of its clusters. `expected` has
/// sigma^2 of the points, by which errors are relative.
NormalEquations equations_of(std::span<const AllanPoint> points, std::span<const double> expected) {
  NormalEquations equations;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(expected[i] > 0.0)) continue;
    const Eigen::Vector3d row = terms_at(points[i].tau_s) / expected[i];
    const double measured = points[i].sigma * points[i].sigma / expected[i];
    equations.H += points[i].count * row * row.transpose();
    equations.g += points[i].count * measured * row;
  }
  return equations;
}

/// The best non-negative solution: of all subsets of terms, the one of least cost.
Eigen::Vector3d non_negative(const NormalEquations& equations) {
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  double best_gain = 0.0;
  for (unsigned subset = 1; subset < (1U << static_cast<unsigned>(kTerms)); ++subset) {
    Eigen::Matrix3d H = equations.H;
    Eigen::Vector3d g = equations.g;
    for (int i = 0; i < kTerms; ++i) {
      if ((subset >> static_cast<unsigned>(i) & 1U) != 0U) continue;
      H.row(i).setZero();
      H.col(i).setZero();
      H(i, i) = 1.0;
      g(i) = 0.0;
    }
    const Eigen::Vector3d x = H.fullPivLu().solve(g);
    const double gain = g.dot(x);
    if (!(x.minCoeff() >= 0.0) || gain <= best_gain) continue;
    best = x;
    best_gain = gain;
  }
  return best;
}

}  // namespace

std::vector<AllanPoint> allan_deviation(std::span<const double> readings, double period_s) {
  std::vector<double> theta(readings.size() + 1, 0.0);
  for (std::size_t i = 0; i < readings.size(); ++i)
    theta[i + 1] = theta[i] + (readings[i] - readings[0]) * period_s;
  std::vector<AllanPoint> points;
  for (std::size_t octave = 1; octave * kLeastClusters <= readings.size(); octave *= 2) {
    for (const std::size_t m : {octave, octave + octave / 2}) {
      const double tau_s = static_cast<double>(m) * period_s;
      const bool is_there = !points.empty() && tau_s <= points.back().tau_s;
      if (is_there || m * kLeastClusters > readings.size()) continue;
      const double clusters = static_cast<double>(readings.size()) / static_cast<double>(m) - 1.0;
      points.push_back({tau_s, std::sqrt(allan_variance(theta, m, tau_s)), clusters});
    }
  }
  return points;
}

std::optional<NoiseDensities> fit_noise(std::span<const AllanPoint> points) {
  constexpr std::size_t kLeastPoints = 4;
  if (points.size() < kLeastPoints) return std::nullopt;
  std::vector<double> expected;
  for (const AllanPoint& point : points) expected.push_back(point.sigma * point.sigma);
  NormalEquations equations = equations_of(points, expected);
  Eigen::Vector3d x = non_negative(equations);
  // Errors relative to what was measured would prefer what is small by chance.
  for (int round = 0; round < kReweighted && x.maxCoeff() > 0.0; ++round) {
    for (std::size_t i = 0; i < points.size(); ++i) expected[i] = terms_at(points[i].tau_s).dot(x);
    equations = equations_of(points, expected);
    x = non_negative(equations);
  }
  const Eigen::Matrix3d covariance = kShared * equations.H.inverse();
  NoiseDensities noise;
  noise.white = std::sqrt(x[0]);
  noise.bias_stability = std::sqrt(x[1]);
  noise.random_walk = std::sqrt(x[2]);
  // d sqrt(x) = dx / (2 sqrt(x)); of what is not there, the root of its own sigma.
  const auto sigma_of_root = [&](int i) {
    const double sigma = std::sqrt(std::max(0.0, covariance(i, i)));
    return std::min(std::sqrt(sigma), sigma / (2.0 * std::sqrt(std::max(x[i], 1e-300))));
  };
  noise.white_sigma = sigma_of_root(0);
  noise.random_walk_sigma = sigma_of_root(2);
  return noise;
}

}  // namespace crepes
