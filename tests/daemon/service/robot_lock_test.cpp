#include "daemon/service/robot_lock.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <utility>

namespace crepes::robot_lock_test {
namespace {

/// Claims are of the whole machine, where other tests may run: ids of this process.
RobotId id_of_this_process(int shift) {
  constexpr int kIds = 60000;
  return RobotId{static_cast<std::uint16_t>(1000 + (::getpid() + shift) % kIds)};
}
const RobotId kRobot = id_of_this_process(0);
const RobotId kOther = id_of_this_process(30000);

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
  {
    auto moved = simulated->moved_to("wlan0", 47474);
    ASSERT_TRUE(moved && *moved);
    *simulated = std::move(**moved);
  }
  EXPECT_TRUE(RobotLock::claim(kRobot, "lo", 50001));  // is free again
  EXPECT_EQ(RobotLock::claim(kRobot, "bat0", 47474).error().code, ErrorCode::kBusy);
}

}  // namespace
}  // namespace crepes::robot_lock_test
