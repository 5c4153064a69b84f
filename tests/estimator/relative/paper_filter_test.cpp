#include "estimator/relative/paper_filter.hpp"

#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::paper_filter_test {
namespace {

using test::largest_difference;
using test::numeric_jacobian;
using test::RandomGeometry;
using E = PaperError;
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Jacobian = Eigen::Matrix<double, 9, E::kSize>;

constexpr int kStates = 300;
constexpr double kTolerance = 2e-8;  // of central differences on values below 20

RelativeMotion random_motion(RandomGeometry& random) { return {random.pose(), random.vector()}; }
BodyRates random_rates(RandomGeometry& random) { return {random.vector(2.0), random.vector(6.0)}; }

/// What can be measured of an error: twelve numbers describe nine degrees of freedom.
Vector9d difference(const RelativeMotion& from, const RelativeMotion& to) {
  const Vector6d pose = pose_difference(from.T_B_N, to.T_B_N);
  Vector9d d;
  d << pose.head<3>(), to.v_B_N - from.v_B_N, pose.tail<3>();
  return d;
}

/// Derivative of  d -> x (+) F d  as differences see it.
Jacobian derivative_through(const RelativeMotion& x, const E::Covariance& F) {
  return numeric_jacobian<9, E::kSize>(
      [&](const E::Vector& d) { return difference(x, paper_plus(x, F * d)); });
}

/// The terms that eq. 10 leaves out: position by attitude, through dt^2/2 of the acceleration.
E::Covariance dropped_terms(const RelativeMotion& x, const BodyRates& rates_B,
                            const BodyRates& rates_A, double dt) {
  const Eigen::Matrix3d dR_B = so3_exp(rates_B.w * dt).conjugate().toRotationMatrix();
  E::Covariance F = E::Covariance::Zero();
  F.block<3, 3>(E::kP, E::kThetaA) = -0.5 * dt * dt * dR_B * x.T_B_N.R() * hat(rates_A.a);
  F.block<3, 3>(E::kP, E::kThetaB) = 0.5 * dt * dt * dR_B * hat(rates_B.a);
  return F;
}

TEST(PaperFilter, TransitionIsTheDerivativeOfThePropagationButForTheTermsInDtSquared) {
  RandomGeometry random(1);
  for (int i = 0; i < kStates; ++i) {
    const RelativeMotion x = random_motion(random);
    const BodyRates rates_B = random_rates(random);
    const BodyRates rates_A = random_rates(random);
    const double dt = random.uniform(1e-3, 0.02);
    const RelativeMotion next = paper_propagated(x, rates_B, rates_A, dt);

    const auto numeric = numeric_jacobian<9, E::kSize>([&](const E::Vector& d) {
      return difference(next, paper_propagated(paper_plus(x, d), rates_B, rates_A, dt));
    });

    const E::Covariance F = paper_transition(x, rates_B, rates_A, dt);
    const E::Covariance dropped = dropped_terms(x, rates_B, rates_A, dt);
    EXPECT_LT(largest_difference(derivative_through(next, F + dropped), numeric), kTolerance);
    // To first order in dt the printed F_x is the whole derivative.
    const double a = rates_A.a.norm() + rates_B.a.norm();
    EXPECT_LT(largest_difference(derivative_through(next, F), numeric), 0.5 * dt * dt * a + 1e-8);
  }
}

TEST(PaperFilter, NoiseInputIsTheDerivativeByTheImuNoiseToFirstOrderInDt) {
  RandomGeometry random(2);
  for (int i = 0; i < kStates; ++i) {
    const RelativeMotion x = random_motion(random);
    const BodyRates rates_B = random_rates(random);
    const BodyRates rates_A = random_rates(random);
    const double dt = 1e-4;
    const RelativeMotion next = paper_propagated(x, rates_B, rates_A, dt);

    // The true rates are the measured ones minus the noise a_nA, w_nA, a_nB, w_nB.
    const auto numeric = numeric_jacobian<9, E::kSize>([&](const E::Vector& n) {
      const BodyRates true_A{rates_A.w - n.segment<3>(3), rates_A.a - n.head<3>()};
      const BodyRates true_B{rates_B.w - n.tail<3>(), rates_B.a - n.segment<3>(6)};
      return difference(next, paper_propagated(x, true_B, true_A, dt));
    });

    // Dropped: dt^2/2 in position (by the forces), J_r = I - dt/2 [w]x + ... times dt and p or v
    // (by the gyros).
    const double w = rates_A.w.norm() + rates_B.w.norm();
    const double size = 1.0 + x.T_B_N.p.norm() + x.v_B_N.norm();
    EXPECT_LT(
        largest_difference(derivative_through(next, paper_noise_input(x, rates_B, dt)), numeric),
        dt * dt * (1.0 + w) * size + 1e-10);
  }
}

TEST(PaperFilter, InnovationJacobianIsTheDerivativeOfTheMeasurement) {
  RandomGeometry random(3);
  for (int i = 0; i < kStates; ++i) {
    const RelativeMotion x = random_motion(random);
    RawPose z;
    z.T_B_N = x.T_B_N;
    z.p_N_B = x.T_B_N.inverse().p;
    z.covariance = random.covariance<9>(0.1);

    const auto innovation = paper_innovation(x, z);

    EXPECT_LT(innovation.residual.norm(), 1e-12);
    EXPECT_EQ(innovation.cov_z, z.covariance);
    const auto minus_H = numeric_jacobian<9, E::kSize>(
        [&](const E::Vector& d) { return paper_innovation(paper_plus(x, d), z).residual; });
    EXPECT_LT(largest_difference(innovation.H, -minus_H), kTolerance);
  }
}

TEST(PaperFilter, ResetIsTheDerivativeOfTheErrorThatIsLeftToFirstOrderInTheCorrection) {
  RandomGeometry random(4);
  for (int i = 0; i < kStates; ++i) {
    const RelativeMotion x = random_motion(random);
    const E::Vector dx_hat = random.normal_vector<E::kSize>(0.05);
    const RelativeMotion corrected = paper_plus(x, dx_hat);

    const auto numeric = numeric_jacobian<9, E::kSize>(
        [&](const E::Vector& e) { return difference(corrected, paper_plus(x, dx_hat + e)); });

    // I - [theta/2]x stands for J_r(theta); the next term is [theta]x^2 / 6, and it reaches p and v
    // by a lever of their own size.
    const double theta =
        std::max(dx_hat.segment<3>(E::kThetaA).norm(), dx_hat.segment<3>(E::kThetaB).norm());
    const double lever = 1.0 + corrected.T_B_N.p.norm() + corrected.v_B_N.norm();
    EXPECT_LT(largest_difference(derivative_through(corrected, paper_reset(dx_hat)), numeric),
              theta * theta / 6.0 * lever + 1e-8);
  }
}

TEST(PaperFilter, ResetIsFarBetterThanNone) {
  RandomGeometry random(5);
  for (int i = 0; i < 50; ++i) {
    const RelativeMotion x = random_motion(random);
    E::Vector dx_hat = random.normal_vector<E::kSize>(0.02);
    dx_hat.head<6>().setZero();
    const RelativeMotion corrected = paper_plus(x, dx_hat);
    const auto numeric = numeric_jacobian<9, E::kSize>(
        [&](const E::Vector& e) { return difference(corrected, paper_plus(x, dx_hat + e)); });

    const double with =
        largest_difference(derivative_through(corrected, paper_reset(dx_hat)), numeric);
    const double without =
        largest_difference(derivative_through(corrected, E::Covariance::Identity()), numeric);

    EXPECT_LT(with, 0.2 * without);
  }
}

TEST(PaperFilter, TwoSidedErrorTurnsPositionAndVelocityWithTheObserver) {
  RandomGeometry random(6);
  for (int i = 0; i < kStates; ++i) {
    const RelativeMotion x = random_motion(random);
    E::Vector dx = E::Vector::Zero();
    dx.segment<3>(E::kThetaB) = random.vector(0.3);
    // A common turn of both frames, seen from either side.
    dx.segment<3>(E::kThetaA) = x.T_B_N.q.conjugate() * dx.segment<3>(E::kThetaB);

    const RelativeMotion turned = paper_plus(x, dx);

    EXPECT_LT(so3_log(turned.T_B_N.q.conjugate() * x.T_B_N.q).norm(), 1e-12);
    EXPECT_NEAR(turned.T_B_N.p.norm(), x.T_B_N.p.norm(), 1e-12);
  }
}

TEST(PaperFilter, StartsWithTheCovarianceOfTheRawPose) {
  RandomGeometry random(7);
  RawPose first;
  first.T_B_N = random.pose();
  first.covariance = random.covariance<9>(0.1);

  const PaperFilter filter(Timestamp{}, first, ProcessNoise{});

  EXPECT_LT(largest_difference(filter.pose_covariance(), first.gaussian().covariance), 1e-14);
}

}  // namespace
}  // namespace crepes::paper_filter_test
