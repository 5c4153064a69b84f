#include "daemon/service/robot_lock.hpp"

#include <gtest/gtest.h>

namespace crepes {
namespace {

// Ids that no other test uses: claims are of the whole machine.
const RobotId kRobot{60017};
const RobotId kOther{60018};

TEST(RobotLock, IsOnePerRobotOnAllInterfacesOfTheMachine) {
  const auto first = RobotLock::claim(kRobot, "bat0", 47474);
  ASSERT_TRUE(first) << first.error().message;

  EXPECT_EQ(RobotLock::claim(kRobot, "bat0", 47474).error().code, ErrorCode::kBusy);
  EXPECT_EQ(RobotLock::claim(kRobot, "wlan0", 50000).error().code, ErrorCode::kBusy);
  EXPECT_TRUE(RobotLock::claim(kOther, "bat0", 47474));
  EXPECT_TRUE(RobotLock::claim(kRobot, "lo", 47474));  // reaches no robot
}

TEST(RobotLock, LeavesEachPortOfTheMachineItselfToASwarm) {
  const auto first = RobotLock::claim(kRobot, "lo", 50001);
  ASSERT_TRUE(first) << first.error().message;

  EXPECT_EQ(RobotLock::claim(kRobot, "lo", 50001).error().code, ErrorCode::kBusy);
  EXPECT_TRUE(RobotLock::claim(kRobot, "lo", 50002));
}

TEST(RobotLock, FollowsToAnotherMesh) {
  auto simulated = RobotLock::claim(kRobot, "lo", 50001);
  ASSERT_TRUE(simulated) << simulated.error().message;
  EXPECT_FALSE(simulated->moved_to("lo", 50001).value());  // is the same

  {
    const auto real = RobotLock::claim(kRobot, "bat0", 47474);
    ASSERT_TRUE(real);
    EXPECT_EQ(simulated->moved_to("wlan0", 47474).error().code, ErrorCode::kBusy);
    EXPECT_FALSE(real->moved_to("wlan0", 47475).value());
  }
  auto moved = simulated->moved_to("wlan0", 47474);
  ASSERT_TRUE(moved && *moved);
  *simulated = std::move(**moved);
  EXPECT_TRUE(RobotLock::claim(kRobot, "lo", 50001));  // is free again
  EXPECT_EQ(RobotLock::claim(kRobot, "bat0", 47474).error().code, ErrorCode::kBusy);
}

}  // namespace
}  // namespace crepes
