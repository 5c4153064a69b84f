#include "estimator/relative/range_update.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/random_geometry.hpp"

namespace crepes::range_update_test {
namespace {

using E = ErrorState;

constexpr double kNoGate = std::numeric_limits<double>::infinity();
constexpr double kNoise = 0.05;

/// A neighbor 5 m ahead; lever arms are zero, all other states known.
struct Scene {
  NominalState state;
  E::Covariance P;

  Scene(double along, double across) {
    state.motion.T_B_N.p = {5.0, 0.0, 0.0};
    P.diagonal().segment<3>(E::kP) << along * along, across * across, across * across;
  }
  Fusion fuse(double range_m) {
    const Eigen::Vector3d& p = state.motion.T_B_N.p;
    const auto z =
        linearize_range(state, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), range_m, kNoise);
    const RangeUpdate update = update_by_range(*z, p.norm(), kNoGate, P);
    inject(update.correction, state);
    return update.fusion;
  }
  [[nodiscard]] double sigma(int axis) const { return std::sqrt(P.diagonal()(E::kP + axis)); }
};

TEST(RangeUpdate, ErrorsAreAsLargeAsItSaysAboutABadlyKnownDirection) {
  constexpr int kRuns = 200;
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    test::RandomGeometry random(seed);
    Scene scene(0.2, 0.5);
    const Eigen::Matrix3d prior = scene.P.seen().topLeftCorner<3, 3>();
    const Eigen::Vector3d truth = scene.state.motion.T_B_N.p + random.draw<3>(prior);
    for (int i = 0; i < 200; ++i)
      scene.fuse(truth.norm() + random.draw<1>(Eigen::Matrix<double, 1, 1>(kNoise * kNoise))(0));

    const Eigen::Vector3d e = truth - scene.state.motion.T_B_N.p;
    const Eigen::Matrix3d P = scene.P.seen().topLeftCorner<3, 3>();
    sum += e.dot(P.ldlt().solve(e)) / 3.0;
  }
  EXPECT_LT(sum / kRuns, 1.5);
  EXPECT_GT(sum / kRuns, 0.5);
}

TEST(RangeUpdate, DoesNotKnowTheRangeBetterThanTheErrorThatAllShare) {
  constexpr double kShared = 0.15;
  Scene scene(1.0, 0.1);
  for (int i = 0; i < 100; ++i) {
    const auto z = linearize_ring_distance(scene.state, Eigen::Vector3d::Zero(),
                                           Eigen::Vector3d::Zero(), 5.3, kNoise);
    const RangeUpdate update =
        update_by_range(*z, scene.state.motion.T_B_N.p.norm(), kNoGate, scene.P, kShared * kShared);
    inject(update.correction, scene.state);
  }
  EXPECT_GE(scene.sigma(0), kShared);
  EXPECT_LT(scene.sigma(0), 1.05 * kShared);
  EXPECT_NEAR(scene.state.motion.T_B_N.p.x(), 5.3, 0.02);

  const auto z = linearize_ring_distance(scene.state, Eigen::Vector3d::Zero(),
                                         Eigen::Vector3d::Zero(), 5.6, kNoise);
  scene.P.diagonal()(E::kP) = 0.1 * 0.1;
  EXPECT_TRUE(update_by_range(*z, 5.3, kNoGate, scene.P, kShared * kShared).correction.isZero());
}

TEST(RangeUpdate, RangesDoNotMakeABadlyKnownDirectionKnown) {
  Scene scene(0.2, 0.5);
  for (int i = 0; i < 1000; ++i) {
    // The neighbor circles by some degrees, so that all lines differ.
    const double angle = 0.1 * std::sin(0.1 * i);
    scene.state.motion.T_B_N.p = {5.0 * std::cos(angle), 5.0 * std::sin(angle), 0.0};
    scene.fuse(5.0);
  }
  EXPECT_GT(scene.sigma(1), 0.25);
  EXPECT_GT(scene.sigma(2), 0.47);
}

/// A neighbor that passes 1.7 m away, out of sight: nobody knows its velocity to better than 0.25
/// m/s. It is estimated from ranges alone.
struct Passing {
  NominalState state;
  E::Covariance P;
  Eigen::Vector3d p;
  Eigen::Vector3d v;
  double bias_m = 0.0;

  explicit Passing(test::RandomGeometry& random) {
    state.motion.T_B_N.p = {-2.0, 1.7, 0.0};
    state.motion.v_B_N = {1.0, 0.0, 0.0};
    P.diagonal().segment<3>(E::kP).setConstant(0.05 * 0.05);
    P.diagonal().segment<3>(E::kV).setConstant(0.25 * 0.25);
    P.diagonal()(E::kRangeBias) = 0.1 * 0.1;
    p = state.motion.T_B_N.p + random.vector(0.05);
    v = state.motion.v_B_N + random.vector(0.25);
    bias_m = random.normal(0.1);
  }
  void pass(double dt) {
    p += dt * v;
    state.motion.T_B_N.p += dt * state.motion.v_B_N;
    E::Covariance::Full F = E::Covariance::Full::Identity();
    F.block<3, 3>(E::kP, E::kV) = dt * Eigen::Matrix3d::Identity();
    P = E::Covariance(E::Covariance::Full(F * P.full() * F.transpose()));
  }
  void measure(double noise) {
    const Eigen::Vector3d none = Eigen::Vector3d::Zero();
    const double distance_m = state.motion.T_B_N.p.norm();
    const auto z = linearize_range(state, none, none, p.norm() + bias_m + noise, kNoise);
    inject(update_by_range(*z, distance_m, 10.8, P).correction, state);
  }
  [[nodiscard]] double nees() const {
    const Eigen::Vector3d e = p - state.motion.T_B_N.p;
    return e.dot(P.seen().topLeftCorner<3, 3>().ldlt().solve(e));
  }
};

// Whose direction is lost: ranges to it made that known, and wrong.
TEST(RangeUpdate, RangesToANeighborThatPassesUnseenAreHonest) {
  constexpr double kStep = 0.04;  // s
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    test::RandomGeometry random(seed);
    Passing neighbor(random);
    for (int i = 0; i < 100; ++i) {  // until its position is known to a meter only
      neighbor.pass(kStep);
      neighbor.measure(random.normal(kNoise));
      worst = std::max(worst, neighbor.nees());
    }
  }
  EXPECT_LT(worst, 35.0);
}

TEST(RangeUpdate, ABearingsWorthOfDirectionLeavesAllOfTheRange) {
  Scene scene(0.2, 0.005);
  scene.fuse(5.0);
  const double of_a_linear_filter = 0.2 * kNoise / std::hypot(0.2, kNoise);
  EXPECT_LT(scene.sigma(0), 1.25 * of_a_linear_filter);  // the rest: it may be false
}

TEST(RangeUpdate, OneRangeThatMayBeFalseDoesNotSettleTheDistance) {
  Scene scene(0.25, 0.005);
  scene.fuse(5.6);  // 2.4 sigma

  EXPECT_GT(3.0 * scene.sigma(0), scene.state.motion.T_B_N.p.x() - 5.0);
  for (int i = 0; i < 10; ++i) scene.fuse(5.0);
  EXPECT_NEAR(scene.state.motion.T_B_N.p.x(), 5.0, 0.05);
}

TEST(RangeUpdate, LeavesACovarianceWhereDirectionAndDistanceAreOpenTogether) {
  for (const double across : {0.2, 0.35, 0.5}) {
    for (const double along : {0.3, 0.6, 1.0}) {
      for (double off = 0.2; off < 3.0; off += 0.1) {
        Scene scene(along, across);
        scene.P.diagonal().tail(E::kSize - 3).setConstant(1e-4);
        auto position = scene.P.seen().topLeftCorner<3, 3>();
        position(0, 1) = position(1, 0) = 0.9 * along * across;
        scene.fuse(5.0 + off);

        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(scene.P.full());
        ASSERT_GT(parts.eigenvalues()(0), 0.0) << across << ' ' << along << ' ' << off;
      }
    }
  }
}

}  // namespace
}  // namespace crepes::range_update_test
