#include "estimator/calibration/batch/arrow_system.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace crepes::arrow_system_test {
namespace {

constexpr int kState = ArrowSystem::kState;

/// Random positive definite normal equations, and the same as one dense matrix.
struct Twin {
  ArrowSystem arrow;
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

Twin twin(int states, int constants) {
  std::mt19937 engine(1);
  std::normal_distribution<double> normal;
  const int size = states * kState + constants;
  Twin twin{ArrowSystem(static_cast<std::size_t>(states), constants),
            Eigen::MatrixXd::Identity(size, size), Eigen::VectorXd::Zero(size)};
  for (int k = 0; k + 1 < states; ++k) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(40, size);
    for (int row = 0; row < J.rows(); ++row) {
      for (int i = 0; i < 2 * kState; ++i) J(row, k * kState + i) = normal(engine);
      for (int i = 0; i < constants; ++i) J(row, states * kState + i) = normal(engine);
    }
    twin.H += J.transpose() * J;
  }
  for (double& value : twin.g) value = normal(engine);
  for (int k = 0; k < states; ++k) {
    const auto at = static_cast<std::size_t>(k);
    twin.arrow.diagonal(at) = twin.H.block<kState, kState>(k * kState, k * kState);
    if (k + 1 < states)
      twin.arrow.to_next(at) = twin.H.block<kState, kState>(k * kState, (k + 1) * kState);
    twin.arrow.to_constants(at) = twin.H.block(k * kState, states * kState, kState, constants);
    twin.arrow.gradient(at) = twin.g.segment<kState>(k * kState);
  }
  twin.arrow.constants() = twin.H.bottomRightCorner(constants, constants);
  twin.arrow.constants_gradient() = twin.g.tail(constants);
  return twin;
}

TEST(ArrowSystem, SolvesAsADenseSolverDoes) {
  const Twin problem = twin(4, 7);
  const auto step = problem.arrow.solve(0.0);
  const Eigen::VectorXd x = problem.H.lu().solve(problem.g);

  ASSERT_TRUE(step);
  EXPECT_LT((step->constants - x.tail(7)).norm(), 1e-9);
  for (int k = 0; k < 4; ++k)
    EXPECT_LT((step->states[static_cast<std::size_t>(k)] - x.segment<kState>(k * kState)).norm(),
              1e-9);
}

TEST(ArrowSystem, KnowsTheCovarianceOfTheConstants) {
  const Twin problem = twin(4, 7);
  const auto step = problem.arrow.solve(0.0);

  ASSERT_TRUE(step);
  EXPECT_LT((step->constants_covariance - problem.H.inverse().bottomRightCorner(7, 7)).norm(),
            1e-9);
}

TEST(ArrowSystem, OfDynamicSizeSolvesTheSame) {
  Twin problem = twin(4, 7);
  TeamArrowSystem team(4, 7, kState);
  for (std::size_t k = 0; k < 4; ++k) {
    team.diagonal(k) = problem.arrow.diagonal(k);
    team.to_next(k) = problem.arrow.to_next(k);
    team.to_constants(k) = problem.arrow.to_constants(k);
    team.gradient(k) = problem.arrow.gradient(k);
  }
  team.constants() = problem.arrow.constants();
  team.constants_gradient() = problem.arrow.constants_gradient();
  const auto step = problem.arrow.solve(1e-3);
  const auto same = team.solve(1e-3);

  ASSERT_TRUE(step && same);
  EXPECT_LT((step->constants - same->constants).norm(), 1e-9);
  EXPECT_LT((step->states[2] - same->states[2]).norm(), 1e-9);
}

TEST(ArrowSystem, RefusesWhatIsNotPositiveDefinite) {
  Twin problem = twin(3, 5);
  problem.arrow.diagonal(1)(0, 0) = -1.0;

  EXPECT_FALSE(problem.arrow.solve(0.0));
}

}  // namespace
}  // namespace crepes::arrow_system_test
