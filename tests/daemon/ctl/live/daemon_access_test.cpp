#include "daemon/ctl/live/daemon_access.hpp"

#include <gtest/gtest.h>

namespace crepes::daemon_access_test {
namespace {

TEST(DaemonAccess, TurnsAPoseIntoTheToolsOwn) {
  client::Pose pose;
  pose.t_ns = 1'234'567'890'123'456'789;
  pose.peer = 3;
  pose.mode = client::Mode::kGraph;
  pose.position = {1.0, -2.0, 3.0};
  pose.orientation = {0.5, -0.5, 0.5, 0.5};
  pose.velocity = {{0.1, 0.2, 0.3}};
  pose.up = {{0.6, 0.0, 0.8}};
  pose.covariance.emplace();
  (*pose.covariance)[0] = 4.0;
  (*pose.covariance)[5] = 0.5;
  pose.age_s = 0.25;
  pose.reset_counter = 2;

  const NeighborPose same = neighbor_pose_of(pose);

  EXPECT_EQ(same.neighbor, RobotId{3});
  EXPECT_EQ(same.stamp, Timestamp{Duration{1'234'567'890'123'456'789}});
  EXPECT_EQ(same.mode, PoseMode::kGraph);
  EXPECT_EQ(same.T_B_N.pose.p, Eigen::Vector3d(1.0, -2.0, 3.0));
  EXPECT_EQ(same.T_B_N.pose.q.coeffs(), Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5).coeffs());
  EXPECT_EQ(same.T_B_N.covariance(0, 0), 4.0);
  EXPECT_EQ(same.T_B_N.covariance(5, 0), 0.5);
  EXPECT_EQ(same.T_B_N.covariance(0, 5), 0.5);
  EXPECT_EQ(same.v_B_N, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(same.up_B, Eigen::Vector3d(0.6, 0.0, 0.8));
  EXPECT_EQ(same.age_s, 0.25);
  EXPECT_EQ(same.reset_counter, 2U);
}

TEST(DaemonAccess, NamesWhyADaemonDoesNotAnswer) {
  EXPECT_EQ(connect({.address = "localhost:1", .port = 1}, {}).error().code, ErrorCode::kUsage);
  EXPECT_EQ(no_answer_from({"10.0.0.1", 7}).message,
            "no answer from 10.0.0.1 port 7: is crepesd running there?");
  EXPECT_EQ(no_answer_from({"10.0.0.1", 7}, "Network is unreachable").message,
            "no answer from 10.0.0.1 port 7: Network is unreachable");
}

}  // namespace
}  // namespace crepes::daemon_access_test
