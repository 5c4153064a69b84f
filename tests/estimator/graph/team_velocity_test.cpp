#include "estimator/graph/team_velocity.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"

namespace crepes::team_velocity_test {
namespace {

using test::RandomGeometry;

constexpr RobotId kSelf{1};

RelativePoseEdge edge(int from, int to, const Eigen::Vector3d& v_from_to) {
  RelativePoseEdge edge;
  edge.from = RobotId{static_cast<std::uint16_t>(from)};
  edge.to = RobotId{static_cast<std::uint16_t>(to)};
  edge.v_from_to = v_from_to;
  return edge;
}

TEST(TeamVelocity, AddsVelocitiesAlongAChainInTheAxesOfSelf) {
  RandomGeometry random(1);
  const std::map<RobotId, Pose> poses{
      {kSelf, {}}, {RobotId{2}, random.pose()}, {RobotId{3}, random.pose()}};
  const Eigen::Vector3d v_1_2 = random.vector();
  const Eigen::Vector3d v_2_3 = random.vector();

  const auto v = team_velocities(kSelf, poses, {edge(1, 2, v_1_2), edge(2, 3, v_2_3)});

  EXPECT_EQ(v.at(kSelf), Eigen::Vector3d::Zero());
  EXPECT_LT((v.at(RobotId{2}) - v_1_2).norm(), 1e-12);
  EXPECT_LT((v.at(RobotId{3}) - v_1_2 - poses.at(RobotId{2}).q * v_2_3).norm(), 1e-12);
}

TEST(TeamVelocity, AnEdgeAndItsReverseAgree) {
  RandomGeometry random(2);
  const std::map<RobotId, Pose> poses{{kSelf, {}}, {RobotId{2}, random.pose()}};
  const Eigen::Vector3d v_1_2 = random.vector();
  const Eigen::Vector3d v_2_1 = -(poses.at(RobotId{2}).q.conjugate() * v_1_2);

  const auto forward = team_velocities(kSelf, poses, {edge(1, 2, v_1_2)});
  const auto backward = team_velocities(kSelf, poses, {edge(2, 1, v_2_1)});

  EXPECT_LT((forward.at(RobotId{2}) - backward.at(RobotId{2})).norm(), 1e-12);
}

TEST(TeamVelocity, AveragesContradictoryEdges) {
  const std::map<RobotId, Pose> poses{{kSelf, {}}, {RobotId{2}, {}}};

  const auto v = team_velocities(kSelf, poses, {edge(1, 2, {1, 0, 0}), edge(1, 2, {2, 0, 0})});

  EXPECT_NEAR(v.at(RobotId{2}).x(), 1.5, 1e-12);
}

TEST(TeamVelocity, SpreadsTheErrorOfALoopEvenly) {
  const std::map<RobotId, Pose> poses{{kSelf, {}}, {RobotId{2}, {}}, {RobotId{3}, {}}};

  const auto v = team_velocities(
      kSelf, poses, {edge(1, 2, {1, 0, 0}), edge(2, 3, {1, 0, 0}), edge(1, 3, {2.3, 0, 0})});

  EXPECT_NEAR(v.at(RobotId{2}).x(), 1.1, 1e-12);
  EXPECT_NEAR(v.at(RobotId{3}).x(), 2.2, 1e-12);
}

TEST(TeamVelocity, IgnoresEdgesOfRobotsWithoutAPose) {
  const std::map<RobotId, Pose> poses{{kSelf, {}}, {RobotId{2}, {}}};

  const auto v = team_velocities(kSelf, poses, {edge(1, 2, {1, 0, 0}), edge(2, 9, {5, 0, 0})});

  ASSERT_EQ(v.size(), 2U);
  EXPECT_NEAR(v.at(RobotId{2}).x(), 1.0, 1e-12);
}

}  // namespace
}  // namespace crepes::team_velocity_test
