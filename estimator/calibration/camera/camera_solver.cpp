#include "estimator/calibration/camera/camera_solver.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "estimator/calibration/batch/robust.hpp"

namespace crepes {
namespace {

constexpr double kFirstDamping = 1e-4;
constexpr double kMostDamping = 1e8;
constexpr double kDampingStep = 6.0;

struct Descent {
  CameraState state;
  bool has_converged = false;
};

Descent descend(const CameraProblem& problem, const CameraState& prior, CameraState state, int most,
                double tolerance) {
  Descent descent{std::move(state)};
  double cost = problem.cost(descent.state, prior);
  double damping = kFirstDamping;
  for (int i = 0; i < most && !descent.has_converged; ++i) {
    const ArrowSystem system = problem.linearize(descent.state, prior);
    bool is_better = false;
    while (!is_better && damping < kMostDamping) {
      const auto step = system.solve(damping);
      if (step) {
        CameraState next = moved(descent.state, *step);
        const double next_cost = problem.cost(next, prior);
        if (next_cost < cost) {
          is_better = true;
          descent.has_converged = cost - next_cost < tolerance * cost;
          descent.state = std::move(next);
          cost = next_cost;
        }
      }
      damping *= is_better ? 1.0 / kDampingStep : kDampingStep;
    }
    if (!is_better) {
      descent.has_converged = true;
      break;
    }
    damping = std::max(damping, 1e-12);
  }
  return descent;
}

double sigma_of(const std::vector<SightingResidual>& residuals, const std::vector<double>& mask) {
  std::vector<double> squares;
  for (std::size_t i = 0; i < residuals.size(); ++i)
    if (residuals[i].is_valid && mask[i] > 0.0) squares.push_back(residuals[i].uv.squaredNorm());
  return robust_sigma_px(std::move(squares));
}

std::vector<double> weights_of(const std::vector<SightingResidual>& residuals, double sigma_px,
                               const std::vector<double>& mask) {
  std::vector<double> weights;
  weights.reserve(residuals.size());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const double w = robust_weight(residuals[i].uv.squaredNorm(), sigma_px, 2.0);
    weights.push_back(residuals[i].is_valid ? mask[i] * w : 0.0);
  }
  return weights;
}

CameraSolution finished(const CameraProblem& problem, const CameraState& prior, Descent descent,
                        const std::vector<double>& weights) {
  CameraSolution solution;
  solution.residuals = problem.residuals(descent.state);
  if (const auto step = problem.linearize(descent.state, prior).solve(0.0))
    solution.covariance = step->constants_covariance;
  solution.sigma_px = problem.sigma_px();
  solution.outliers = outlier_share(weights);
  solution.has_converged = descent.has_converged;
  solution.state = std::move(descent.state);
  return solution;
}

}  // namespace

CameraSolution solve_camera(CameraProblem& problem, const CameraState& start,
                            const Progress& progress) {
  struct Stage {
    double sigma_px;  ///< 0: as the residuals say
    int iterations;
    double tolerance;
    double done;
  };
  constexpr std::array<Stage, 5> kStages{{{10.0, 15, 1e-2, 0.3},
                                          {2.0, 15, 1e-2, 0.5},
                                          {0.0, 15, 1e-3, 0.7},
                                          {0.0, 10, 1e-4, 0.85},
                                          {0.0, 10, 1e-6, 1.0}}};
  const std::vector<double> all(problem.sightings().size(), 1.0);
  std::vector<double> weights = all;
  Descent descent{start};
  for (const Stage& stage : kStages) {
    double sigma_px = stage.sigma_px;
    if (&stage != kStages.data()) {
      const auto residuals = problem.residuals(descent.state);
      if (sigma_px == 0.0) sigma_px = sigma_of(residuals, all);
      weights = weights_of(residuals, std::max(sigma_px, sigma_of(residuals, all)), all);
    }
    problem.set_sigma_px(sigma_px);
    problem.set_weights(weights);
    descent = descend(problem, start, std::move(descent.state), stage.iterations, stage.tolerance);
    if (progress) progress(stage.done);
  }
  return finished(problem, start, std::move(descent), weights);
}

CameraSolution resolve_camera(CameraProblem& problem, const CameraState& prior,
                              const CameraSolution& solution, const std::vector<double>& mask) {
  constexpr int kIterations = 5;
  constexpr double kTolerance = 1e-5;
  const std::vector<double> weights = weights_of(solution.residuals, solution.sigma_px, mask);
  problem.set_sigma_px(solution.sigma_px);
  problem.set_weights(weights);
  return finished(problem, prior, descend(problem, prior, solution.state, kIterations, kTolerance),
                  weights);
}

}  // namespace crepes
