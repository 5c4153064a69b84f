#include "estimator/team/readings/team_update.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "tests/support/random_geometry.hpp"

namespace crepes::team_update_test {
namespace {

using test::RandomGeometry;

constexpr int kStates = 30;

Eigen::MatrixXd random_covariance(RandomGeometry& random) {
  Eigen::MatrixXd A(kStates, kStates);
  for (double& a : A.reshaped()) a = random.normal(1.0);
  return A * A.transpose() + 0.1 * Eigen::MatrixXd::Identity(kStates, kStates);
}

std::vector<TeamRow> random_rows(RandomGeometry& random, int count) {
  std::vector<TeamRow> rows(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    TeamRow& row = rows[i];
    row.dimension = i % 3 == 0 ? 1 : 2;
    row.variance = random.uniform(0.01, 1.0);
    row.size = 7;
    row.H.setZero();
    for (int a = 0; a < row.size; ++a) {
      row.columns.at(static_cast<std::size_t>(a)) = (static_cast<int>(i) * 5 + 3 * a) % kStates;
      for (int d = 0; d < row.dimension; ++d) row.H(d, a) = random.normal(1.0);
    }
    for (int d = 0; d < row.dimension; ++d) row.residual(d) = random.normal(1.0);
  }
  return rows;
}

struct Dense {
  Eigen::MatrixXd H;
  Eigen::VectorXd r;
  Eigen::VectorXd variance;
};

Dense dense(const std::vector<TeamRow>& rows) {
  Eigen::Index m = 0;
  for (const TeamRow& row : rows) m += row.dimension;
  Dense all{Eigen::MatrixXd::Zero(m, kStates), Eigen::VectorXd(m), Eigen::VectorXd(m)};
  Eigen::Index k = 0;
  for (const TeamRow& row : rows) {
    for (int d = 0; d < row.dimension; ++d, ++k) {
      for (int a = 0; a < row.size; ++a)
        all.H(k, row.columns.at(static_cast<std::size_t>(a))) += row.H(d, a);
      all.r(k) = row.residual(d);
      all.variance(k) = row.variance;
    }
  }
  return all;
}

/// The gain of a Kalman filter.
Eigen::MatrixXd gain_of(const Dense& all, const Eigen::MatrixXd& P) {
  const Eigen::MatrixXd S =
      all.H * P * all.H.transpose() + Eigen::MatrixXd(all.variance.asDiagonal());
  return P * all.H.transpose() * S.inverse();
}

/// The covariance after a correction with any gain K.
Eigen::MatrixXd josephs_form(const Dense& all, const Eigen::MatrixXd& K, const Eigen::MatrixXd& P) {
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(kStates, kStates) - K * all.H;
  return rest * P * rest.transpose() + K * all.variance.asDiagonal() * K.transpose();
}

TEST(TeamUpdate, IsThatOfTheInformationFilter) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomGeometry random(seed);
    Eigen::MatrixXd P = random_covariance(random);
    const std::vector<TeamRow> rows = random_rows(random, 12);
    const Dense all = dense(rows);
    const Eigen::VectorXd dx = Eigen::VectorXd::Random(kStates);
    const Eigen::MatrixXd W = all.variance.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd expected = (P.inverse() + all.H.transpose() * W * all.H).eval().inverse();
    const Eigen::VectorXd expected_dx = expected * all.H.transpose() * W * (all.r + all.H * dx);

    const TeamUpdate update(rows, dx, P, P);
    ASSERT_TRUE(update.is_valid());
    EXPECT_LT((update.correction() - expected_dx).norm(), 1e-8 * expected_dx.norm());
    update.correct(std::vector<bool>(kStates, true), P);
    EXPECT_LT((P - expected).norm(), 1e-8 * expected.norm());
    EXPECT_EQ(P, P.transpose().eval());
  }
}

// With the gain of the corrected states alone, Joseph's form holds.
TEST(TeamUpdate, StatesThatAreNotCorrectedCountAllTheSame) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomGeometry random(seed);
    Eigen::MatrixXd P = random_covariance(random);
    const Eigen::MatrixXd before = P;
    const std::vector<TeamRow> rows = random_rows(random, 6);
    const Dense all = dense(rows);
    std::vector<bool> corrected(kStates, true);
    Eigen::MatrixXd K = gain_of(all, P);
    for (int i = 0; i < kStates; i += 3) {
      corrected[static_cast<std::size_t>(i)] = false;
      K.row(i).setZero();
    }
    const Eigen::MatrixXd expected = josephs_form(all, K, P);
    TeamUpdate(rows, Eigen::VectorXd::Zero(kStates), P, P).correct(corrected, P);
    EXPECT_LT((P - expected).norm(), 1e-8 * expected.norm());
    for (int i = 0; i < kStates; i += 3) EXPECT_EQ(P(i, i), before(i, i));
    EXPECT_EQ(Eigen::LLT<Eigen::MatrixXd>(P).info(), Eigen::Success);
  }
}

// Joseph's form for a smaller gain: that of one error, and of what goes with it, is missing.
TEST(TeamUpdate, AnErrorThatIsWithheldKeepsItsVariance) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomGeometry random(seed);
    Eigen::MatrixXd P = random_covariance(random);
    const Eigen::MatrixXd before = P;
    const std::vector<TeamRow> rows = random_rows(random, 6);
    const Dense all = dense(rows);
    std::vector<bool> corrected(kStates, true);
    Eigen::MatrixXd K = gain_of(all, P);
    Eigen::VectorXd error = Eigen::VectorXd::Zero(kStates);
    error.segment<3>(4) = random.normal_vector<3>(1.0);
    K -= (P * error / error.dot(P * error) * (error.transpose() * K)).eval();
    if (seed > 10) {
      for (int i = 0; i < 4; ++i) {
        corrected[static_cast<std::size_t>(i)] = false;
        K.row(i).setZero();
      }
    }
    const Eigen::MatrixXd expected = josephs_form(all, K, P);
    const Eigen::VectorXd expected_dx = K * all.r;

    TeamUpdate update(rows, Eigen::VectorXd::Zero(kStates), P, P);
    update.withhold(error, 1e12, P);
    update.correct(corrected, P);

    EXPECT_LT((P - expected).norm(), 1e-8 * expected.norm()) << seed;
    EXPECT_EQ(P, P.transpose().eval());
    EXPECT_NEAR(error.dot(P * error), error.dot(before * error), 1e-8 * error.dot(before * error));
    for (int i = 0; i < kStates; ++i) {
      if (corrected[static_cast<std::size_t>(i)])
        EXPECT_NEAR(update.correction()(i), expected_dx(i), 1e-8 * expected_dx.norm());
    }
  }
}

TEST(TeamUpdate, AnErrorThatIsSeenClearlyIsCorrected) {
  RandomGeometry random(1);
  const Eigen::MatrixXd P = random_covariance(random);
  std::vector<TeamRow> rows = random_rows(random, 6);
  Eigen::VectorXd error = Eigen::VectorXd::Zero(kStates);
  error(4) = 1.0;
  const TeamUpdate whole(rows, Eigen::VectorXd::Zero(kStates), P, P);
  TeamUpdate part(rows, Eigen::VectorXd::Zero(kStates), P, P);
  part.withhold(error, 1e-9, P);
  EXPECT_LT((part.correction() - whole.correction()).norm(), 1e-6 * whole.correction().norm());
}

// Ten times as many readings as they depend on states, of which two are redundant, and states that
// they depend on through others.
TEST(TeamUpdate, ManyReadingsOfFewStatesCorrectAllStates) {
  constexpr int kSeen = 6;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomGeometry random(seed);
    Eigen::MatrixXd P = random_covariance(random);
    Eigen::MatrixXd B(kSeen, kStates);
    for (double& b : B.reshaped()) b = random.normal(1.0);
    std::vector<TeamRow> rows = random_rows(random, 40);
    Dense all = dense(rows);
    all.H.resize(all.r.size(), kStates);
    Eigen::Index k = 0;
    for (TeamRow& row : rows) {
      row.size = kSeen;
      Eigen::Matrix<double, 2, kSeen> H = row.H.leftCols<kSeen>();
      H.col(4) = H.col(0) + H.col(1);
      H.col(5) = H.col(2) - H.col(3);
      for (int a = 0; a < kSeen; ++a) row.columns.at(std::size_t(a)) = a;
      row.H.leftCols<kSeen>() = H;
      all.H.middleRows(k, row.dimension) = H.topRows(row.dimension) * B;
      k += row.dimension;
    }
    const Eigen::MatrixXd W = all.variance.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd expected = (P.inverse() + all.H.transpose() * W * all.H).eval().inverse();
    const Eigen::VectorXd expected_dx = expected * all.H.transpose() * W * all.r;

    const Eigen::MatrixXd of_all = P * B.transpose();
    const TeamUpdate update(rows, Eigen::VectorXd::Zero(kSeen), B * of_all, of_all);
    ASSERT_TRUE(update.is_valid());
    EXPECT_LT((update.correction() - expected_dx).norm(), 1e-7 * expected_dx.norm());
    update.correct(std::vector<bool>(kStates, true), P);
    EXPECT_LT((P - expected).norm(), 1e-7 * expected.norm());
  }
}

}  // namespace
}  // namespace crepes::team_update_test
