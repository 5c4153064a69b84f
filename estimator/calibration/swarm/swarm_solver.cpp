#include "estimator/calibration/swarm/swarm_solver.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimator/calibration/batch/robust.hpp"
#include "estimator/core/quantile.hpp"

namespace crepes {
namespace {

constexpr double kFirstSwarmDamping = 1e-13;
constexpr double kMostSwarmDamping = 1e6;
constexpr double kSwarmDampingStep = 30.0;
constexpr double kLeastRangeSigma_m = 0.005;
constexpr double kMedianOfAbsolute = 0.6745;

struct SwarmDescent {
  SwarmState state;
  bool has_converged = false;
};

SwarmDescent descend(const SwarmProblem& problem, const SwarmState& prior, SwarmState state,
                     int most, double tolerance) {
  SwarmDescent descent{std::move(state)};
  double cost = problem.cost(descent.state, prior);
  double damping = kFirstSwarmDamping;
  for (int i = 0; i < most && !descent.has_converged; ++i) {
    const TeamArrowSystem system = problem.linearize(descent.state, prior);
    bool is_better = false;
    for (; !is_better && damping < kMostSwarmDamping; damping *= kSwarmDampingStep) {
      const auto step = system.solve(damping);
      if (!step) continue;
      SwarmState next = moved(descent.state, *step);
      const double next_cost = problem.cost(next, prior);
      if (!(next_cost < cost)) continue;
      is_better = true;
      descent.has_converged = cost - next_cost < tolerance * cost;
      descent.state = std::move(next);
      cost = next_cost;
    }
    if (!is_better) {
      descent.has_converged = true;
      break;
    }
    damping = std::max(kFirstSwarmDamping, damping / (kSwarmDampingStep * kSwarmDampingStep));
  }
  return descent;
}

double spot_sigma(const std::vector<SightingResidual>& residuals) {
  std::vector<double> squares;
  for (const SightingResidual& residual : residuals)
    if (residual.is_valid) squares.push_back(residual.uv.squaredNorm());
  return robust_sigma_px(std::move(squares));
}

double range_sigma(const std::vector<std::vector<double>>& residuals) {
  std::vector<double> sizes;
  for (const std::vector<double>& robot : residuals) {
    for (const double r : robot)
      if (std::isfinite(r)) sizes.push_back(std::abs(r));
  }
  if (sizes.empty()) return kLeastRangeSigma_m;
  return std::max(kLeastRangeSigma_m, upper_median(sizes) / kMedianOfAbsolute);
}

SwarmWeights swarm_weights(const SwarmResiduals& residuals, const std::vector<double>& sigma_px,
                           double sigma_m) {
  SwarmWeights weights;
  for (std::size_t r = 0; r < sigma_px.size(); ++r) {
    std::vector<double>& spots = weights.sightings.emplace_back();
    for (const SightingResidual& residual : residuals.sightings[r]) {
      spots.push_back(residual.is_valid ? robust_weight(residual.uv.squaredNorm(), sigma_px[r], 2.0)
                                        : 0.0);
    }
    std::vector<double>& ranges = weights.ranges.emplace_back();
    for (const double error : residuals.ranges[r])
      ranges.push_back(std::isfinite(error) ? robust_weight(error * error, sigma_m, 1.0) : 0.0);
  }
  return weights;
}

}  // namespace

SwarmSolution solve_swarm(SwarmProblem& problem, const SwarmState& start,
                          const Progress& progress) {
  struct Stage {
    double sigma_px;  ///< 0: as the residuals say
    double sigma_m;
    int iterations;
    double tolerance;
    double done;
  };
  constexpr std::array<Stage, 4> kStages{{{10.0, 0.5, 8, 3e-2, 0.3},
                                          {2.0, 0.2, 6, 1e-2, 0.5},
                                          {0.0, 0.0, 6, 1e-3, 0.75},
                                          {0.0, 0.0, 4, 1e-5, 0.95}}};
  SwarmDescent descent{start};
  SwarmWeights weights;
  SwarmSolution solution;
  for (const Stage& stage : kStages) {
    const SwarmResiduals residuals = problem.residuals(descent.state);
    std::vector<double> sigma_px;
    for (const auto& robot : residuals.sightings)
      sigma_px.push_back(std::max(stage.sigma_px, spot_sigma(robot)));
    const double sigma_m = std::max(stage.sigma_m, range_sigma(residuals.ranges));
    weights = swarm_weights(residuals, sigma_px, sigma_m);
    if (&stage == kStages.data()) {
      for (std::size_t r = 0; r < sigma_px.size(); ++r)
        for (double& w : weights.sightings[r]) w = std::max(w, 0.05);
    }
    problem.set_weights(weights);
    problem.set_sigmas(sigma_px, sigma_m);
    solution.sigma_px = sigma_px;
    solution.sigma_m = sigma_m;
    descent = descend(problem, start, std::move(descent.state), stage.iterations, stage.tolerance);
    if (progress) progress(stage.done);
  }
  solution.residuals = problem.residuals(descent.state);
  if (auto step = problem.linearize(descent.state, start).solve(kFirstSwarmDamping))
    solution.covariance = std::move(step->constants_covariance);
  std::vector<double> ranges;
  for (std::size_t r = 0; r < problem.robots(); ++r) {
    solution.outliers.push_back(outlier_share(weights.sightings[r]));
    ranges.insert(ranges.end(), weights.ranges[r].begin(), weights.ranges[r].end());
  }
  solution.range_outliers = outlier_share(ranges);
  solution.has_converged = descent.has_converged;
  solution.state = std::move(descent.state);
  if (progress) progress(1.0);
  return solution;
}

}  // namespace crepes
