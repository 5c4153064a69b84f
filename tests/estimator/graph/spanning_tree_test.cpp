#include "estimator/graph/spanning_tree.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"

namespace crepes::spanning_tree_test {
namespace {

using test::RandomGeometry;

constexpr RobotId kSelf{1};

RelativePoseEdge edge(int from, int to, const Pose& pose, double sigma = 0.1) {
  return {RobotId{static_cast<std::uint16_t>(from)},
          RobotId{static_cast<std::uint16_t>(to)},
          {pose, sigma * sigma * Matrix6d::Identity()},
          Eigen::Vector3d::Zero()};
}

TEST(SpanningTree, OfNoEdgesIsSelfAlone) {
  const auto poses = spanning_tree_poses(kSelf, {});

  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses.at(kSelf).pose.p, Eigen::Vector3d::Zero());
  EXPECT_TRUE(poses.at(kSelf).covariance.isZero());
}

TEST(SpanningTree, FollowsEdgesInEitherDirection) {
  RandomGeometry random(1);
  const Pose T_1_2 = random.pose();
  const Pose T_3_2 = random.pose();

  const auto poses = spanning_tree_poses(kSelf, {edge(3, 2, T_3_2), edge(1, 2, T_1_2)});

  ASSERT_TRUE(poses.contains(RobotId{3}));
  const Pose expected = T_1_2 * T_3_2.inverse();
  EXPECT_LT(pose_difference(expected, poses.at(RobotId{3}).pose).norm(), 1e-12);
}

TEST(SpanningTree, PrefersTheMoreCertainChainToTheShorterOne) {
  const Pose step{{1.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const Pose wrong{{9.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const auto x_of_robot_3 = [&](double sigma_of_direct) {
    const auto poses = spanning_tree_poses(
        kSelf, {edge(1, 3, wrong, sigma_of_direct), edge(1, 2, step, 0.1), edge(2, 3, step, 0.1)});
    return poses.at(RobotId{3}).pose.p.x();
  };

  EXPECT_NEAR(x_of_robot_3(1.0), 2.0, 1e-12);
  EXPECT_NEAR(x_of_robot_3(0.05), 9.0, 1e-12);
}

TEST(SpanningTree, AddsTheVariancesOfAChain) {
  const Pose step{};
  const auto poses = spanning_tree_poses(kSelf, {edge(1, 2, step, 0.3), edge(2, 3, step, 0.4)});

  EXPECT_NEAR(poses.at(RobotId{3}).covariance(0, 0), 0.25, 1e-12);
}

TEST(SpanningTree, LeavesOutRobotsWithoutAChain) {
  const auto poses = spanning_tree_poses(kSelf, {edge(1, 2, {}), edge(3, 4, {})});

  EXPECT_EQ(poses.size(), 2U);
  EXPECT_FALSE(poses.contains(RobotId{3}));
}

}  // namespace
}  // namespace crepes::spanning_tree_test
