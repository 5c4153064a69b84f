#include "estimator/core/pose.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"

namespace crepes::pose_test {
namespace {

using test::RandomGeometry;

TEST(Pose, ChainsSoThatInnerFramesCancel) {
  RandomGeometry random(1);
  for (int i = 0; i < 200; ++i) {
    const Pose T_A_B = random.pose();
    const Pose T_B_C = random.pose();
    const Eigen::Vector3d p_C = random.vector();

    const Pose T_A_C = T_A_B * T_B_C;

    EXPECT_LT((T_A_C * p_C - T_A_B * (T_B_C * p_C)).norm(), 1e-13);
    EXPECT_LT((T_A_C.R() - T_A_B.R() * T_B_C.R()).norm(), 1e-14);
  }
}

TEST(Pose, ChainIsAssociative) {
  RandomGeometry random(2);
  for (int i = 0; i < 200; ++i) {
    const Pose a = random.pose();
    const Pose b = random.pose();
    const Pose c = random.pose();

    EXPECT_LT(pose_difference((a * b) * c, a * (b * c)).norm(), 1e-13);
  }
}

TEST(Pose, InverseUndoesThePoseFromBothSides) {
  RandomGeometry random(3);
  for (int i = 0; i < 200; ++i) {
    const Pose T_A_B = random.pose();
    const Pose T_B_A = T_A_B.inverse();

    EXPECT_LT(pose_difference(Pose{}, T_A_B * T_B_A).norm(), 1e-13);
    EXPECT_LT(pose_difference(Pose{}, T_B_A * T_A_B).norm(), 1e-13);
  }
}

TEST(Pose, ALongChainKeepsAUnitQuaternion) {
  RandomGeometry random(4);
  Pose chain;
  for (int i = 0; i < 10000; ++i) chain = chain * Pose{Eigen::Vector3d::Zero(), random.rotation()};

  EXPECT_NEAR(chain.q.norm(), 1.0, 1e-15);
}

TEST(Pose, DifferenceIsThePerturbationThatWasApplied) {
  RandomGeometry random(5);
  for (int i = 0; i < 200; ++i) {
    const Pose T_A_B = random.pose();
    Vector6d d;
    d << random.vector(), random.uniform(0.0, 3.1) * random.direction();

    EXPECT_LT((pose_difference(T_A_B, perturbed(T_A_B, d)) - d).norm(), 1e-13);
  }
}

TEST(Pose, PerturbationByTheDifferenceReachesTheOtherPose) {
  RandomGeometry random(6);
  for (int i = 0; i < 200; ++i) {
    const Pose from = random.pose();
    const Pose to = random.pose();

    const Pose reached = perturbed(from, pose_difference(from, to));

    EXPECT_LT((reached.p - to.p).norm(), 1e-14);
    EXPECT_LT((reached.R() - to.R()).norm(), 1e-13);
  }
}

TEST(Pose, PositionErrorIsInTheReferenceAxesAndAttitudeErrorInTheBodys) {
  const Pose T_A_B{{1.0, 2.0, 3.0}, so3_exp({0.0, 0.0, 1.5707963267948966})};
  Vector6d d;
  d << 0.1, 0.0, 0.0, 0.2, 0.0, 0.0;

  const Pose moved = perturbed(T_A_B, d);

  EXPECT_LT((moved.p - Eigen::Vector3d(1.1, 2.0, 3.0)).norm(), 1e-15);
  // A turn about B's x axis, which is A's y axis.
  EXPECT_LT((so3_log(moved.q * T_A_B.q.conjugate()) - Eigen::Vector3d(0.0, 0.2, 0.0)).norm(),
            1e-15);
}

}  // namespace
}  // namespace crepes::pose_test
