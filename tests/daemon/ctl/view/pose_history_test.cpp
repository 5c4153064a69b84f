#include "daemon/ctl/view/pose_history.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace crepes::pose_history_test {
namespace {

using std::chrono::milliseconds;

const RobotId kNeighbor{2};

Timestamp at_ms(int ms) { return Timestamp{} + milliseconds{ms}; }

NeighborPose pose_at(int ms) {
  NeighborPose pose;
  pose.neighbor = kNeighbor;
  pose.stamp = at_ms(ms);
  pose.T_B_N.pose.p = Eigen::Vector3d(0.001 * ms, 0, 0);
  return pose;
}

TEST(PoseHistory, InterpolatesBetweenPoses) {
  PoseHistory history;
  for (int ms = 0; ms <= 200; ms += 20) history.add(pose_at(ms));

  EXPECT_NEAR(history.at(kNeighbor, at_ms(113)).value().p.x(), 0.113, 1e-9);
  EXPECT_NEAR(history.at(kNeighbor, at_ms(250)).value().p.x(), 0.2, 1e-9);
  EXPECT_FALSE(history.at(kNeighbor, at_ms(400)));
  EXPECT_FALSE(history.at(RobotId{3}, at_ms(100)));
}

TEST(PoseHistory, HasNothingWhereItLost) {
  PoseHistory history;
  history.add(pose_at(0));
  history.add(pose_at(900));
  EXPECT_FALSE(history.at(kNeighbor, at_ms(450)));
  history.add(pose_at(1500));
  EXPECT_FALSE(history.at(kNeighbor, at_ms(0)));  // older than a second
  history.add(pose_at(20));                       // the daemon has started anew
  EXPECT_FALSE(history.at(kNeighbor, at_ms(1500)));
}

}  // namespace
}  // namespace crepes::pose_history_test
