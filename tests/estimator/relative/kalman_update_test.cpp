#include "estimator/relative/kalman_update.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <limits>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::kalman_update_test {
namespace {

using test::RandomGeometry;

constexpr int kN = 12;
constexpr int kM = 3;
constexpr double kNoGate = std::numeric_limits<double>::infinity();
using Covariance = Eigen::Matrix<double, kN, kN>;

Innovation<kM, kN> random_innovation(RandomGeometry& random, double sigma) {
  Innovation<kM, kN> z;
  z.residual = random.normal_vector<kM>();
  for (double& x : z.H.reshaped()) x = random.normal();
  z.cov_z = random.covariance<kM>(sigma);
  return z;
}

TEST(KalmanUpdate, EqualsTheTextbook) {
  RandomGeometry random(1);
  for (int i = 0; i < 300; ++i) {
    const Covariance P = random.covariance<kN>(1.0);
    const auto z = random_innovation(random, 0.3);

    Covariance updated = P;
    const auto outcome = kalman_update(z, kNoGate, updated);

    const Eigen::Matrix3d S = z.H * P * z.H.transpose() + z.cov_z;
    const Eigen::Matrix<double, kN, kM> K = P * z.H.transpose() * S.inverse();
    const Covariance I_KH = Covariance::Identity() - K * z.H;
    const Covariance joseph = I_KH * P * I_KH.transpose() + K * z.cov_z * K.transpose();
    EXPECT_EQ(outcome.verdict, Verdict::kFused);
    EXPECT_NEAR(outcome.nis, z.residual.dot(S.inverse() * z.residual), 1e-9);
    EXPECT_LT((outcome.correction - K * z.residual).norm(), 1e-11);
    EXPECT_LT(test::largest_difference(updated, joseph), 1e-12);
    EXPECT_LT(test::largest_difference(updated, I_KH * P), 1e-11);
  }
}

TEST(KalmanUpdate, KeepsPSymmetricAndPositiveDefiniteOverAHundredThousandUpdates) {
  RandomGeometry random(2);
  Covariance P = Covariance::Identity();
  double smallest = 1.0;
  for (int i = 0; i < 100000; ++i) {
    // From useless to a thousand times sharper than the state: the harsh end for rounding.
    const auto z = random_innovation(random, std::pow(10.0, random.uniform(-3.0, 1.0)));
    ASSERT_EQ(kalman_update(z, kNoGate, P).verdict, Verdict::kFused);
    P.diagonal().array() += random.uniform(0.0, 1e-3);
    ASSERT_EQ(P, P.transpose());
    if (i % 100 == 0) {
      const Eigen::SelfAdjointEigenSolver<Covariance> eigen(P, Eigen::EigenvaluesOnly);
      smallest = std::min(smallest, eigen.eigenvalues()(0));
    }
  }
  EXPECT_GT(smallest, 0.0);
}

TEST(KalmanUpdate, OfAPartitionedCovarianceEqualsThatOfTheWhole) {
  constexpr int kSeen = 5;
  RandomGeometry random(6);
  for (int i = 0; i < 300; ++i) {
    auto z = random_innovation(random, 0.3);
    z.H.rightCols<kN - kSeen>().setZero();
    const Innovation<kM, kSeen> z_seen{z.residual, z.H.leftCols<kSeen>(), z.cov_z};
    Covariance whole = random.covariance<kN>(1.0);
    PartitionedCovariance<kSeen, kN> partitioned(whole);

    const auto outcome = kalman_update(z, kNoGate, whole);
    const auto outcome_seen = kalman_update(z_seen, kNoGate, partitioned);

    EXPECT_LT((outcome.correction - outcome_seen.correction).norm(), 1e-12);
    EXPECT_LT(test::largest_difference(whole, partitioned.full()), 1e-12);
    const Covariance full = partitioned.full();
    EXPECT_EQ(full, full.transpose());
  }
}

TEST(KalmanUpdate, AGatedMeasurementChangesNothing) {
  RandomGeometry random(3);
  const Covariance before = random.covariance<kN>(1.0);
  auto z = random_innovation(random, 0.3);
  z.residual *= 1e3;

  Covariance P = before;
  const auto outcome = kalman_update(z, 20.0, P);

  EXPECT_EQ(outcome.verdict, Verdict::kGated);
  EXPECT_GT(outcome.nis, 20.0);
  EXPECT_TRUE(outcome.correction.isZero());
  EXPECT_EQ(P, before);
}

TEST(KalmanUpdate, NotANumberIsNeverFused) {
  RandomGeometry random(4);
  const Covariance before = random.covariance<kN>(1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  auto bad_residual = random_innovation(random, 0.3);
  bad_residual.residual(1) = nan;
  auto bad_model = random_innovation(random, 0.3);
  bad_model.H(0, 4) = nan;
  auto bad_noise = random_innovation(random, 0.3);
  bad_noise.cov_z(2, 2) = nan;

  for (const auto& z : {bad_residual, bad_model, bad_noise}) {
    Covariance P = before;
    EXPECT_NE(kalman_update(z, kNoGate, P).verdict, Verdict::kFused);
    EXPECT_EQ(P, before);
  }
}

TEST(KalmanUpdate, ASingularInnovationIsDegenerate) {
  Innovation<kM, kN> z;
  z.residual.setOnes();
  z.H.setZero();
  z.cov_z.setZero();

  Covariance P = Covariance::Identity();

  EXPECT_EQ(kalman_update(z, kNoGate, P).verdict, Verdict::kDegenerate);
  EXPECT_EQ(P, Covariance::Identity());
}

}  // namespace
}  // namespace crepes::kalman_update_test
