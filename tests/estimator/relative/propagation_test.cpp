#include "estimator/relative/propagation.hpp"

#include <gtest/gtest.h>

#include "estimator/core/constants.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::propagation_test {
namespace {

using namespace std::chrono_literals;
using test::largest_difference;
using test::numeric_jacobian;
using test::RandomGeometry;

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Vector12d = Eigen::Matrix<double, 12, 1>;

constexpr int kStates = 300;
// Values stay below 20 and steps below 0.02 s, so that differences keep nine digits.
constexpr double kTolerance = 2e-8;

RelativeMotion random_motion(RandomGeometry& random) { return {random.pose(), random.vector()}; }
BodyRates random_rates(RandomGeometry& random) { return {random.vector(2.0), random.vector(6.0)}; }

RelativeMotion moved_by(const RelativeMotion& x, const Vector9d& d) {
  Vector6d pose;
  pose << d.head<3>(), d.tail<3>();
  return {perturbed(x.T_B_N, pose), x.v_B_N + d.segment<3>(3)};
}

Vector9d difference(const RelativeMotion& from, const RelativeMotion& to) {
  const Vector6d pose = pose_difference(from.T_B_N, to.T_B_N);
  Vector9d d;
  d << pose.head<3>(), to.v_B_N - from.v_B_N, pose.tail<3>();
  return d;
}

TEST(Propagation, JacobianByTheMotionIsTheDerivative) {
  RandomGeometry random(1);
  for (int i = 0; i < kStates; ++i) {
    const RelativeMotion x = random_motion(random);
    const BodyRates body = random_rates(random);
    const BodyRates neighbor = random_rates(random);
    const double dt = random.uniform(1e-3, 0.02);
    const RelativeMotion after = propagated(x, body, neighbor, dt);

    const auto J = propagation_jacobian(x, after, body, neighbor, dt);

    const auto numeric = numeric_jacobian<9, 9>([&](const Vector9d& d) {
      return difference(after, propagated(moved_by(x, d), body, neighbor, dt));
    });
    EXPECT_LT(largest_difference(J.by_motion, numeric), kTolerance);
  }
}

TEST(Propagation, JacobianByTheRatesIsTheDerivative) {
  RandomGeometry random(2);
  for (int i = 0; i < kStates; ++i) {
    const RelativeMotion x = random_motion(random);
    const BodyRates body = random_rates(random);
    const BodyRates neighbor = random_rates(random);
    const double dt = random.uniform(1e-3, 0.02);
    const RelativeMotion after = propagated(x, body, neighbor, dt);

    const auto J = propagation_jacobian(x, after, body, neighbor, dt);

    const auto numeric = numeric_jacobian<9, 12>([&](const Vector12d& d) {
      const BodyRates turned_body{body.w + d.head<3>(), body.a + d.segment<3>(3)};
      const BodyRates turned_neighbor{neighbor.w + d.segment<3>(6), neighbor.a + d.tail<3>()};
      return difference(after, propagated(x, turned_body, turned_neighbor, dt));
    });
    EXPECT_LT(largest_difference(J.by_rates, numeric), kTolerance);
  }
}

/// A rigid body in a world with gravity that feels constant rates and constant specific force.
struct WorldBody {
  Pose T_W_B;
  Eigen::Vector3d v_W_B = Eigen::Vector3d::Zero();
  BodyRates rates;

  /// Leapfrog in steps so short (10 us) that its own error stays below 1e-8 m.
  void move(double duration, double gravity) {
    constexpr double kStep = 1e-5;
    const auto steps = static_cast<int>(std::lround(duration / kStep));
    const Eigen::Quaterniond half = so3_exp(0.5 * kStep * rates.w);
    for (int i = 0; i < steps; ++i) {
      const Eigen::Vector3d a = (T_W_B.q * half) * rates.a - gravity * Eigen::Vector3d::UnitZ();
      T_W_B.p += kStep * v_W_B + 0.5 * kStep * kStep * a;
      v_W_B += kStep * a;
      T_W_B.q = (T_W_B.q * half * half).normalized();
    }
  }
};

RelativeMotion relative(const WorldBody& B, const WorldBody& N) {
  return {B.T_W_B.inverse() * N.T_W_B, B.T_W_B.q.conjugate() * (N.v_W_B - B.v_W_B)};
}

WorldBody random_body(RandomGeometry& random) {
  return {random.pose(), random.vector(), {random.vector(1.0), random.vector(6.0)}};
}

/// How far `propagated` in steps of `dt` ends from the truth after `duration`.
Vector9d propagation_error(std::uint64_t seed, double dt, double duration, double gravity) {
  RandomGeometry random(seed);
  WorldBody B = random_body(random);
  WorldBody N = random_body(random);
  RelativeMotion x = relative(B, N);
  for (int i = 0; i < std::lround(duration / dt); ++i) x = propagated(x, B.rates, N.rates, dt);
  B.move(duration, gravity);
  N.move(duration, gravity);
  return difference(relative(B, N), x);
}

TEST(Propagation, FollowsTwoRigidBodiesInAWorldWithGravityThatItDoesNotKnow) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Vector9d error = propagation_error(seed, 0.01, 0.2, kGravityMps2);

    // A force that turns within the step: w a dt^2 / 12 a second for the position's rate and
    // w^2 a dt^2 / 24 for the velocity, with w up to 3 rad/s and a up to 15 m/s^2.
    EXPECT_LT(error.head<3>().norm(), 1.5e-4);
    EXPECT_LT(error.segment<3>(3).norm(), 2e-4);
    EXPECT_LT(error.tail<3>().norm(), 1e-9);  // rotation is exact; this is the reference's error
  }
}

TEST(Propagation, ErrorFallsWithTheSquareOfTheStep) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const double coarse = propagation_error(seed, 0.02, 0.2, kGravityMps2).head<6>().norm();
    const double fine = propagation_error(seed, 0.005, 0.2, kGravityMps2).head<6>().norm();

    EXPECT_NEAR(coarse / fine, 16.0, 1.0);
  }
}

TEST(Propagation, IsExactForBodiesThatAccelerateWithoutTurning) {
  RandomGeometry random(3);
  for (int i = 0; i < 50; ++i) {
    const RelativeMotion x = random_motion(random);
    const BodyRates body{Eigen::Vector3d::Zero(), random.vector(6.0)};
    const BodyRates neighbor{Eigen::Vector3d::Zero(), random.vector(6.0)};

    const RelativeMotion once = propagated(x, body, neighbor, 1.0);

    const Eigen::Vector3d a = x.T_B_N.q * neighbor.a - body.a;
    EXPECT_LT((once.T_B_N.p - (x.T_B_N.p + x.v_B_N + 0.5 * a)).norm(), 1e-12);
    EXPECT_LT((once.v_B_N - (x.v_B_N + a)).norm(), 1e-12);
  }
}

/// 2 s of samples every 10 ms of a turning, shaken body.
ImuHistory shaken(RandomGeometry& random) {
  const Eigen::Vector3d w = random.vector(1.0);
  const Eigen::Vector3d a = random.vector(2.0);
  ImuHistory imu;
  for (int i = 0; i <= 200; ++i) {
    const double phase = 0.07 * i;
    imu.push({Timestamp{i * 10ms}, std::sin(phase) * w,
              Eigen::Vector3d(0, 0, 9.81) + std::cos(1.3 * phase) * a});
  }
  return imu;
}

TEST(Propagation, MovedBackEndsWhereItBegan) {
  RandomGeometry random(4);
  for (int i = 0; i < 20; ++i) {
    const ImuHistory imu_B = shaken(random);
    const ImuHistory imu_N = shaken(random);
    const RelativeMotion x = random_motion(random);

    const RelativeMotion there =
        propagated_by_imus(x, imu_B, imu_N, Timestamp{300ms}, Timestamp{800ms});
    const RelativeMotion back =
        propagated_by_imus(there, imu_B, imu_N, Timestamp{800ms}, Timestamp{300ms});

    EXPECT_GT(difference(x, there).norm(), 0.05);
    EXPECT_LT(difference(x, back).norm(), 1e-9);
  }
}

TEST(Propagation, CovarianceOfTheStateFollowsAMonteCarloOfItsErrors) {
  RandomGeometry random(5);
  const ImuHistory imu_B = shaken(random);
  const ImuHistory imu_N = shaken(random);
  NominalState first;
  first.motion = random_motion(random);
  using E = ErrorState;
  E::Vector sigma = E::Vector::Constant(1e-3);
  sigma.segment<12>(E::kGyroB).setConstant(2e-3);
  const E::Covariance P0(E::Covariance::Full(sigma.cwiseAbs2().asDiagonal()));
  const auto run = [&](NominalState state) {
    E::Covariance P = P0;
    propagate(imu_B, imu_N, Timestamp{100ms}, Timestamp{600ms}, ProcessNoise{}, state, P);
    return std::pair(state, P);
  };
  const auto [reference, P] = run(first);
  const E::Vector variance = P.diagonal();

  constexpr int kDraws = 1000;
  Eigen::Matrix<double, 9, 9> sampled = Eigen::Matrix<double, 9, 9>::Zero();
  for (int i = 0; i < kDraws; ++i) {
    NominalState other = first;
    inject(sigma.cwiseProduct(random.normal_vector<E::kSize>()), other);
    const Vector9d d = difference(reference.motion, run(other).first.motion);
    sampled += d * d.transpose() / kDraws;
  }

  // The ratio of two variances from 1000 draws scatters by sqrt(2/1000) = 4.5 %: four sigma.
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(sampled(i, i) / variance(i), 1.0, 0.18) << i;
}

TEST(Propagation, TheRangesBiasWandersWithinItsPrior) {
  using E = ErrorState;
  RandomGeometry random(6);
  const ImuHistory imu_B = shaken(random);
  const ImuHistory imu_N = shaken(random);
  // Stationary: what is forgotten in a second, 2 / 50 of the variance, comes anew.
  constexpr double kSigma = 0.05;
  const ProcessNoise noise{.range_bias_walk = kSigma * std::sqrt(2.0 / 50.0),
                           .range_bias_return = 1.0 / 50.0};
  NominalState state;
  state.range_bias_m = 0.2;
  E::Covariance P(E::Covariance::Full::Identity());
  P.seen()(E::kRangeBias, E::kRangeBias) = kSigma * kSigma;
  P.seen()(E::kMisalignB, E::kRangeBias) = P.seen()(E::kRangeBias, E::kMisalignB) = 0.01;

  for (int i = 0; i < 50; ++i)
    propagate(imu_B, imu_N, Timestamp{100ms}, Timestamp{1100ms}, noise, state, P);

  EXPECT_NEAR(P.seen()(E::kRangeBias, E::kRangeBias), kSigma * kSigma, 1e-3 * kSigma * kSigma);
  EXPECT_NEAR(state.range_bias_m, 0.2 * std::exp(-1.0), 1e-9);
  EXPECT_NEAR(P.seen()(E::kMisalignB, E::kRangeBias), 0.01 * std::exp(-1.0), 1e-9);
  EXPECT_EQ(P.seen()(E::kMisalignB, E::kRangeBias), P.seen()(E::kRangeBias, E::kMisalignB));
}

TEST(Propagation, WhiteNoiseGivesTheSameVarianceInManyStepsAsInFew) {
  ImuHistory imu;
  for (int i = 0; i <= 200; ++i)
    imu.push({Timestamp{i * 10ms}, Eigen::Vector3d::Zero(), {0, 0, 9.81}});
  const ProcessNoise noise{.gyro_density = 0.01, .accel_density = 0.1};
  const auto variance_after = [&](Duration step) {
    NominalState state;
    ErrorState::Covariance P;
    for (Timestamp t{}; t < Timestamp{1s}; t += step) {
      propagate(imu, imu, t, t + step, noise, state, P);
    }
    return P.full();
  };

  const ErrorState::Covariance::Full coarse = variance_after(10ms);
  const ErrorState::Covariance::Full fine = variance_after(1ms);

  // sigma^2 t for the turn of either body, by either's noise.
  EXPECT_NEAR(coarse(ErrorState::kTheta, ErrorState::kTheta), 2 * 1e-4, 2e-6);
  EXPECT_NEAR(fine(ErrorState::kTheta, ErrorState::kTheta), 2 * 1e-4, 2e-6);
  EXPECT_NEAR(fine(ErrorState::kV, ErrorState::kV) / coarse(ErrorState::kV, ErrorState::kV), 1.0,
              0.02);
}

TEST(Propagation, TheBiasOfAnAccelerometerThatBeginsToVibrateBecomesUncertain) {
  using E = ErrorState;
  RandomGeometry random(7);
  ImuHistory steady;
  ImuHistory shaken;
  for (int i = 0; i <= 500; ++i) {
    steady.push({Timestamp{i * 10ms}, random.vector(0.01), random.vector(0.02)});
    shaken.push({Timestamp{i * 10ms}, random.vector(0.01), random.vector(i < 250 ? 0.02 : 1.0)});
  }
  NominalState state;
  E::Covariance P;
  propagate(steady, shaken, Timestamp{2s}, Timestamp{5s}, ProcessNoise{}, state, P);
  EXPECT_EQ(P.diagonal()(E::kAccelB), 0.0);
  EXPECT_NEAR(P.diagonal()(E::kAccelN),
              shaken.mean(Timestamp{2s}, Timestamp{5s}).bias_variance_m2ps4, 1e-12);
  EXPECT_GT(P.diagonal()(E::kAccelN), 0.001);
}

TEST(Propagation, WhatADamagedRateMayHaveTurnedIsUncertain) {
  using E = ErrorState;
  const auto theta_with = [](const Eigen::Vector3d& turn_rad) {
    ImuHistory imu;
    for (int i = 0; i <= 20; ++i)
      imu.push({Timestamp{i * 10ms}, Eigen::Vector3d::Zero(), {0, 0, 9.81}},
               Eigen::Vector3d::Zero(), i == 10 ? turn_rad : Eigen::Vector3d::Zero());
    NominalState state;
    E::Covariance P;
    propagate(imu, imu, Timestamp{}, Timestamp{200ms}, ProcessNoise{}, state, P);
    return Eigen::Vector3d(P.diagonal().segment<3>(E::kTheta));
  };
  const Eigen::Vector3d more = theta_with({0.01, 0.02, 0.0}) - theta_with(Eigen::Vector3d::Zero());
  EXPECT_LT((more - 2.0 * Eigen::Vector3d{1e-4, 4e-4, 0.0}).norm(), 1e-9);  // of both bodies
}

TEST(Propagation, TrustsAGapFarLessThanSamples) {
  ImuHistory steady;
  for (int i = 0; i <= 200; ++i)
    steady.push({Timestamp{i * 10ms}, Eigen::Vector3d::Zero(), {0, 0, 9.81}});
  ImuHistory silent;
  silent.push({Timestamp{}, Eigen::Vector3d::Zero(), {0, 0, 9.81}});
  const ProcessNoise noise{.gyro_density = 1e-3, .accel_density = 1e-3};
  const auto variance_with = [&](const ImuHistory& neighbor) {
    NominalState state;
    ErrorState::Covariance P;
    propagate(steady, neighbor, Timestamp{100ms}, Timestamp{600ms}, noise, state, P);
    return P.diagonal()(ErrorState::kTheta);
  };

  EXPECT_GT(variance_with(silent), 100.0 * variance_with(steady));
}

}  // namespace
}  // namespace crepes::propagation_test
