#include "daemon/ctl/live/waitpose.hpp"

#include <gtest/gtest.h>

#include <csignal>

#include "tests/daemon/ctl/live/served_status.hpp"

namespace crepes::waitpose_test {
namespace {

NeighborStatus neighbor(std::uint16_t id, const std::string& name, NoPoseReason reason) {
  NeighborStatus status;
  status.neighbor = RobotId{id};
  status.name = name;
  status.reason = reason;
  return status;
}

/// Robot 1, which has no pose of its two neighbors.
SystemStatus without_poses() {
  SystemStatus status;
  status.self = RobotId{1};
  status.estimator.neighbors = {neighbor(2, "r2", NoPoseReason::kNotSeen),
                                neighbor(3, "r3", NoPoseReason::kNoRange)};
  return status;
}

std::string error_of(const ServedStatus& daemon, const std::string& peer) {
  const auto pose = wait_for_pose(
      {.daemon = daemon.address(), .peer = peer, .timeout_s = 0.5, .max_sigma_m = {}});
  return pose ? *pose : pose.error().message;
}

TEST(Waitpose, TakesTheNeighborsNameAsWellAsItsId) {
  const ServedStatus daemon(without_poses());

  EXPECT_EQ(error_of(daemon, "r3"), "no pose of robot r3 within 0.5 s: no range");
  EXPECT_EQ(error_of(daemon, "2"), "no pose of robot 2 within 0.5 s: not seen");
}

TEST(Waitpose, RefusesWhoIsNoNeighbor) {
  const ServedStatus daemon(without_poses());

  for (const std::string peer : {"r1", "1", "9", "rover"})
    EXPECT_EQ(error_of(daemon, peer), "robot " + peer + ": it is no other robot of this swarm");
}

TEST(Waitpose, EndsInOrderAtASignal) {
  const ServedStatus daemon(without_poses());
  sigset_t interrupt{};
  sigset_t before{};
  sigemptyset(&interrupt);
  sigaddset(&interrupt, SIGINT);
  pthread_sigmask(SIG_BLOCK, &interrupt, &before);
  std::raise(SIGINT);

  EXPECT_TRUE(error_of(daemon, "r3").starts_with("stopped: "));

  const timespec at_once{};
  sigtimedwait(&interrupt, nullptr, &at_once);  // would end this process
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace
}  // namespace crepes::waitpose_test
