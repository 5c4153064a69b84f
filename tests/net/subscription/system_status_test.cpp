#include "net/subscription/system_status.hpp"

#include <gtest/gtest.h>

namespace crepes::system_status_test {
namespace {

NeighborStatus neighbor(std::uint16_t id, NoPoseReason reason) {
  NeighborStatus status;
  status.neighbor = RobotId{id};
  status.reason = reason;
  return status;
}

TEST(SystemStatus, SaysThatAClockIsUnknownWhereDatagramsArrive) {
  SystemStatus status;
  status.estimator.tilt = Tilt{};
  status.estimator.neighbors = {
      neighbor(2, NoPoseReason::kNeverHeard), neighbor(3, NoPoseReason::kSilent),
      neighbor(4, NoPoseReason::kNeverHeard), neighbor(5, NoPoseReason::kNeverHeard),
      neighbor(6, NoPoseReason::kNotSeen)};
  for (const std::uint16_t id : {2, 3, 4, 6})
    status.traffic.push_back({.peer = RobotId{id}, .received = 9, .age_s = id == 4 ? 3.0 : 0.1});
  status.clocks = {{.peer = RobotId{3}}};

  name_unknown_clocks(status);

  EXPECT_EQ(status.estimator.neighbors[0].reason, NoPoseReason::kNoClockOffset);
  EXPECT_EQ(status.estimator.neighbors[1].reason, NoPoseReason::kSilent) << "its clock is known";
  EXPECT_EQ(status.estimator.neighbors[2].reason, NoPoseReason::kNeverHeard) << "long ago";
  EXPECT_EQ(status.estimator.neighbors[3].reason, NoPoseReason::kNeverHeard);
  EXPECT_EQ(status.estimator.neighbors[4].reason, NoPoseReason::kNotSeen);
}

TEST(SystemStatus, SaysThatTheOwnImuIsWhyNoClockBecomesKnown) {
  SystemStatus status;
  status.estimator.neighbors = {neighbor(2, NoPoseReason::kNeverHeard),
                                neighbor(3, NoPoseReason::kNeverHeard)};
  status.traffic = {{.peer = RobotId{2}, .received = 9, .age_s = 0.1}};

  name_unknown_clocks(status);

  EXPECT_EQ(status.estimator.neighbors[0].reason, NoPoseReason::kNoOwnImu);
  EXPECT_EQ(status.estimator.neighbors[1].reason, NoPoseReason::kNeverHeard);
}

}  // namespace
}  // namespace crepes::system_status_test
