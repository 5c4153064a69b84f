#include "net/mesh/redundancy_filter.hpp"

#include <gtest/gtest.h>

namespace crepes::redundancy_filter_test {
namespace {

using std::chrono::milliseconds;

TEST(RedundancyFilter, PassesABoardAndItsMirrorImageOnceEach) {
  PeerReport report;
  report.stamp = PeerTimestamp{milliseconds{1000}};
  const BasicBearing<PeerTimestamp> board{report.stamp, RobotId{1}, Eigen::Vector3d::UnitX(),
                                          Eigen::Vector3d::Zero(), 0.001};
  BasicBearing<PeerTimestamp> image = board;
  image.u_B = Eigen::Vector3d(1.0, 0.0, -0.1).normalized();
  report.bearings = {board, image, board};
  RedundancyFilter filter;

  PeerReport first = report;
  filter.remove_repeated(first);
  PeerReport again = report;
  filter.remove_repeated(again);

  EXPECT_EQ(first.bearings.size(), 2U);
  EXPECT_TRUE(again.bearings.empty());
}

TEST(RedundancyFilter, RemembersABoundedNumberWhateverTheStamps) {
  RedundancyFilter filter;
  PeerReport first;
  for (int i = 0; i < 200'000; ++i) {
    PeerReport report;
    report.stamp = PeerTimestamp{};  // the sender's clock stands still
    report.ranges = {{PeerTimestamp{milliseconds{i}}, RobotId{1}, 1.0, -80.0, -79.0}};
    if (i == 0) first = report;
    filter.remove_repeated(report);
  }

  EXPECT_LE(filter.size(), 5000U);
}

}  // namespace
}  // namespace crepes::redundancy_filter_test
