/// Distances by the size of the neighbor's LED ring.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "estimator/swarm/reading_intake.hpp"
#include "tests/support/estimator_pair.hpp"
#include "tests/support/resting_pair.hpp"

namespace crepes::ring_distance_test {
namespace {

using namespace std::chrono_literals;
using test::Conditions;
using test::EstimatorPair;

constexpr int kSeeds = 6;

/// At four meters it is as large in the picture as one of 3 cm at 0.6 m.
void give_the_neighbor_a_ring(EstimatorSettings& settings) {
  settings.swarm.members[1].ring_radius_m = 0.2;
}

/// Of the position, over all poses.
double largest_chi2(const EstimatorPair& pair) {
  double largest = 0.0;
  for (const EstimatorPair::Found& found : pair.found()) {
    const Eigen::Vector3d error = found.error.head<3>();
    const Eigen::Matrix3d covariance = found.pose.T_B_N.covariance.topLeftCorner<3, 3>();
    largest = std::max(largest, error.dot(covariance.llt().solve(error)));
  }
  return largest;
}

TEST(RingDistance, GivesAPoseWithoutAnyRange) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    EstimatorPair pair(seed, give_the_neighbor_a_ring);
    pair.run_for(6s, {.has_ranges = false});
    EXPECT_TRUE(pair.found().empty()) << "nothing says how far it is";
    EXPECT_EQ(pair.status().reason, NoPoseReason::kNoRange);

    pair.run_for(6s, {.ring_size = 1.02, .has_ranges = false});

    ASSERT_NE(pair.latest(), nullptr) << "seed " << seed;
    EXPECT_LT(pair.latest()->error.head<3>().norm(), 0.3) << "seed " << seed;
    EXPECT_FALSE(pair.latest()->pose.sources.range);
  }
}

// The board is not as large as configured: all errors have one sign.
TEST(RingDistance, IsHonestWhereTheRadiusIsWrong) {
  for (const double size : {0.94, 0.97, 1.03, 1.06}) {
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      EstimatorPair pair(seed, give_the_neighbor_a_ring);
      pair.run_for(12s, {.ring_size = size, .has_ranges = false});
      ASSERT_GT(pair.found().size(), 100U);
      EXPECT_LT(largest_chi2(pair), 35.0) << "size " << size << ", seed " << seed;
    }
  }
}

TEST(RingDistance, CountsFiveTimesASecondWhileThereIsNoRange) {
  EstimatorPair pair(1, give_the_neighbor_a_ring);
  const auto fused = [&] { return pair.count(MeasurementKind::kRingDistance, Verdict::kFused); };
  pair.run_for(10s, {.ring_size = 1.0});
  EXPECT_EQ(fused(), 0U);
  pair.run_for(10s, {.ring_size = 1.0, .has_ranges = false});
  EXPECT_GE(fused(), 30U);
  EXPECT_LE(fused(), 50U);
}

// The constants of ranges and rings differ: neither change may look like a motion.
TEST(RingDistance, IsHonestWhereRangesComeAndGo) {
  for (const double size : {0.97, 1.03}) {
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      EstimatorPair pair(seed, give_the_neighbor_a_ring);
      for (int i = 0; i < 3; ++i) {
        pair.run_for(4s, {.ring_size = size, .has_ranges = false});
        pair.run_for(4s, {.ring_size = size});
      }
      EXPECT_LT(largest_chi2(pair), 35.0) << "size " << size << ", seed " << seed;
    }
  }
}

TEST(RingDistance, OfARobotAndItsImageInOneFrameAreAlternatives) {
  ReadingIntake intake(RobotId{2}, test::resting::settings());
  Bearing robot{.stamp = Timestamp{10s}, .neighbor = RobotId{2}};
  robot.distance_m = 4.0;
  robot.distance_sigma_m = 0.2;
  Bearing image = robot;
  image.u_B = Eigen::Vector3d::UnitY();
  image.distance_m = 5.0;
  Bearing next = robot;
  next.stamp += 10ms;
  for (const Bearing& bearing : {robot, image, next}) intake.add_bearing(bearing);

  std::vector<std::pair<MeasurementKind, std::size_t>> groups;
  ReorderBuffer& buffer = intake.buffer();
  for (auto group = buffer.pop_ready(Timestamp{20s}); !group.empty();
       group = buffer.pop_ready(Timestamp{20s})) {
    groups.emplace_back(group.front().kind, group.size());
  }
  using Kind = MeasurementKind;
  EXPECT_EQ(groups, (std::vector<std::pair<Kind, std::size_t>>{
                        {Kind::kBearing, 2}, {Kind::kRingDistance, 2}, {Kind::kBearing, 1}}));
}

}  // namespace
}  // namespace crepes::ring_distance_test
