#include <gtest/gtest.h>

#include "estimator/relative/bearing_measurement.hpp"
#include "estimator/relative/pose_measurement.hpp"
#include "estimator/relative/range_measurement.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::measurement_jacobians_test {
namespace {

using test::largest_difference;
using test::numeric_jacobian;
using test::RandomGeometry;
using E = ErrorState;

constexpr int kStates = 300;
// Central differences with a step of 1e-5 over functions whose third derivative is at most
// 1 / distance^3 with distances above 0.3 m.
constexpr double kTolerance = 2e-8;

NominalState random_state(RandomGeometry& random) {
  NominalState state;
  state.motion = {random.pose(), random.vector()};
  state.bias_B = {random.vector(0.01), random.vector(0.1)};
  state.bias_N = {random.vector(0.01), random.vector(0.1)};
  state.range_bias_m = random.normal(0.1);
  state.misalignment_B = random.vector(0.1);
  state.misalignment_N = random.vector(0.1);
  return state;
}

NominalState injected(NominalState state, const E::Vector& dx) {
  inject(dx, state);
  return state;
}

/// Where a camera at `p_B_C` sees the ring: the model of bearing_measurement.hpp, written anew.
Eigen::Vector3d predicted_bearing(const NominalState& state, const Eigen::Vector3d& p_B_C,
                                  const Eigen::Vector3d& p_N_M) {
  const Eigen::Vector3d line = state.motion.T_B_N * p_N_M - p_B_C;
  return so3_exp(state.misalignment_B) * line.normalized();
}

Eigen::Vector3d predicted_peer_bearing(const NominalState& state, const Eigen::Vector3d& p_N_C,
                                       const Eigen::Vector3d& p_B_M) {
  const Eigen::Vector3d line = state.motion.T_B_N.inverse() * p_B_M - p_N_C;
  return so3_exp(state.misalignment_N) * line.normalized();
}

/// A measurement knows of the seen states alone; those it leaves out must not matter.
template <int M>
void expect_equal(const Eigen::Matrix<double, M, E::kSeen>& H,
                  const Eigen::Matrix<double, M, E::kSize>& numeric) {
  EXPECT_LT(largest_difference(H, numeric.template leftCols<E::kSeen>()), kTolerance);
  EXPECT_TRUE(numeric.template rightCols<E::kSize - E::kSeen>().isZero(0.0));
}

TEST(BearingMeasurement, JacobianIsTheDerivativeOfTheModel) {
  RandomGeometry random(1);
  for (int i = 0; i < kStates; ++i) {
    const NominalState state = random_state(random);
    const Eigen::Vector3d p_B_C = random.vector(0.1);
    const Eigen::Vector3d p_N_M = random.vector(0.1);
    if ((state.motion.T_B_N * p_N_M - p_B_C).norm() < 0.5) continue;
    const Eigen::Vector3d u = predicted_bearing(state, p_B_C, p_N_M);

    const auto z = linearize_bearing(state, u, p_B_C, p_N_M, 0.01);

    ASSERT_TRUE(z.has_value());
    EXPECT_LT(z->residual.norm(), 1e-12);
    const auto across = tangent_basis(u);
    const auto H = numeric_jacobian<2, E::kSize>([&](const E::Vector& dx) -> Eigen::Vector2d {
      return across.transpose() * predicted_bearing(injected(state, dx), p_B_C, p_N_M);
    });
    expect_equal(z->H, H);
  }
}

TEST(BearingMeasurement, PeerJacobianIsTheDerivativeOfTheModel) {
  RandomGeometry random(2);
  for (int i = 0; i < kStates; ++i) {
    const NominalState state = random_state(random);
    const Eigen::Vector3d p_N_C = random.vector(0.1);
    const Eigen::Vector3d p_B_M = random.vector(0.1);
    if ((state.motion.T_B_N.inverse() * p_B_M - p_N_C).norm() < 0.5) continue;
    const Eigen::Vector3d u = predicted_peer_bearing(state, p_N_C, p_B_M);

    const auto z = linearize_peer_bearing(state, u, p_N_C, p_B_M, 0.01);

    ASSERT_TRUE(z.has_value());
    EXPECT_LT(z->residual.norm(), 1e-12);
    const auto across = tangent_basis(u);
    const auto H = numeric_jacobian<2, E::kSize>([&](const E::Vector& dx) -> Eigen::Vector2d {
      return across.transpose() * predicted_peer_bearing(injected(state, dx), p_N_C, p_B_M);
    });
    expect_equal(z->H, H);
  }
}

TEST(BearingMeasurement, ResidualIsTheAngleToThePrediction) {
  RandomGeometry random(3);
  for (int i = 0; i < kStates; ++i) {
    NominalState state;
    state.motion.T_B_N.p = 3.0 * random.direction();
    const Eigen::Vector3d predicted = state.motion.T_B_N.p.normalized();
    const double angle = random.uniform(0.0, 1.5);
    const Eigen::Vector3d axis = tangent_basis(predicted).col(0);
    const Eigen::Vector3d u = so3_exp(angle * axis) * predicted;

    const auto z = linearize_bearing(state, u, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 1);

    ASSERT_TRUE(z.has_value());
    EXPECT_NEAR(z->residual.norm(), angle, 1e-12);
  }
}

TEST(BearingMeasurement, RefusesARingAtTheCameraAndADirectionBehindIt) {
  NominalState state;
  state.motion.T_B_N.p = {0.05, 0.0, 0.0};
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();

  EXPECT_FALSE(linearize_bearing(state, Eigen::Vector3d::UnitX(), zero, zero, 0.01));
  EXPECT_FALSE(linearize_peer_bearing(state, -Eigen::Vector3d::UnitX(), zero, zero, 0.01));

  state.motion.T_B_N.p = {3.0, 0.0, 0.0};
  EXPECT_FALSE(linearize_bearing(state, -Eigen::Vector3d::UnitX(), zero, zero, 0.01));
  EXPECT_FALSE(linearize_peer_bearing(state, Eigen::Vector3d::UnitX(), zero, zero, 0.01));
}

/// Of a distance between points of both bodies; `bias_m` is that of the state which is in it.
template <class Linearize, class Bias>
void expect_distance_model(std::uint64_t seed, const Linearize& linearize, const Bias& bias_m) {
  RandomGeometry random(seed);
  for (int i = 0; i < kStates; ++i) {
    const NominalState state = random_state(random);
    const Eigen::Vector3d p_B = random.vector(0.1);
    const Eigen::Vector3d p_N = random.vector(0.1);
    const auto model = [&](const NominalState& x) {
      return (x.motion.T_B_N * p_N - p_B).norm() + bias_m(x);
    };
    if (model(state) < 0.5) continue;

    const auto z = linearize(state, p_B, p_N, model(state) + 0.3, 0.05);

    ASSERT_TRUE(z.has_value());
    EXPECT_NEAR(z->residual(0), 0.3, 1e-12);
    EXPECT_DOUBLE_EQ(z->cov_z(0, 0), 0.05 * 0.05);
    const auto H = numeric_jacobian<1, E::kSize>([&](const E::Vector& dx) {
      return Eigen::Matrix<double, 1, 1>(model(injected(state, dx)));
    });
    expect_equal(z->H, H);
  }
}

TEST(RangeMeasurement, JacobianIsTheDerivativeOfTheModel) {
  expect_distance_model(4, linearize_range, [](const NominalState& x) { return x.range_bias_m; });
}

TEST(RingDistanceMeasurement, JacobianIsTheDerivativeOfTheModel) {
  expect_distance_model(6, linearize_ring_distance, [](const NominalState&) { return 0.0; });
}

TEST(RangeMeasurement, RefusesAntennasThatCoincide) {
  NominalState state;
  state.motion.T_B_N.p = {0.2, 0.0, 0.0};

  EXPECT_FALSE(linearize_range(state, {0.2, 0.0, 0.04}, Eigen::Vector3d::Zero(), 0.04, 0.05));
  EXPECT_TRUE(linearize_range(state, {0.2, 0.0, 0.06}, Eigen::Vector3d::Zero(), 0.06, 0.05));
}

TEST(PoseMeasurement, JacobianIsMinusTheDerivativeOfTheResidualAtAnyResidual) {
  RandomGeometry random(5);
  for (int i = 0; i < kStates; ++i) {
    const NominalState state = random_state(random);
    Vector6d offset;
    offset << random.vector(), random.uniform(0.0, 2.5) * random.direction();
    const GaussianPose measured{perturbed(state.motion.T_B_N, offset), random.covariance<6>(0.1)};

    const auto z = linearize_pose(state, measured);

    EXPECT_LT((z.residual - offset).norm(), 1e-12);
    EXPECT_EQ(z.cov_z, measured.covariance);
    const auto minus_H = numeric_jacobian<6, E::kSize>([&](const E::Vector& dx) -> Vector6d {
      return linearize_pose(injected(state, dx), measured).residual;
    });
    expect_equal<6>(z.H, -minus_H);
  }
}

}  // namespace
}  // namespace crepes::measurement_jacobians_test
