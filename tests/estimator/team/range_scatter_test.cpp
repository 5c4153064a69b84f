/// Ranges that err more than configured.
#include "estimator/team/belief/range_scatter.hpp"

#include <gtest/gtest.h>

#include "estimator/team/team_filter.hpp"
#include "tests/support/random_geometry.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::range_scatter_test {
namespace {

constexpr int kSeeds = 20;

/// After so many innovations that scatter as this says, one in ten of them from far away.
double found(std::uint64_t seed, double variance, int count, double outliers = 0.0) {
  test::RandomGeometry random(seed);
  RangeScatter scatter;
  for (int i = 0; i < count; ++i) {
    const bool is_outlier = random.uniform(0.0, 1.0) < outliers;
    const double e = random.normal(is_outlier ? 100.0 : std::sqrt(variance));
    scatter.add(e * e / scatter.factor());
  }
  return scatter.factor();
}

TEST(RangeScatter, FindsTheVariance) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    EXPECT_NEAR(std::log(found(seed, 4.0, 400)), std::log(4.0), 0.5) << seed;
    EXPECT_NEAR(std::log(found(seed, 4.0, 400, 0.1)), std::log(4.0), 0.9) << seed;
  }
}

TEST(RangeScatter, HardlyDoubtsWhatIsConfigured) {
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) sum += found(seed, 1.0, 400);
  EXPECT_LT(sum / kSeeds, 1.2);
}

TEST(RangeScatter, NeverBelievesRangesMoreThanConfigured) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) EXPECT_EQ(found(seed, 0.1, 400), 1.0);
}

TEST(RangeScatter, IsBounded) { EXPECT_LE(found(1, 1e6, 1000), 9.01); }

/// Mean NEES of positions after some seconds, with ranges that err so many times as configured, now
/// and always, one in five intervals.
double mean_nees(double times) {
  double sum = 0.0;
  double count = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    test::SimulatedTeam team(seed);
    test::RandomGeometry random(seed + 1000);
    std::map<RobotPair, double> bias_m;
    int interval = 0;
    team.damage = [&](TeamInterval& next) {
      if (interval++ % 5 != 0) next.ranges.clear();
      for (TeamRange& z : next.ranges) {
        const RobotPair pair(z.observer, z.neighbor);
        if (!bias_m.contains(pair)) bias_m[pair] = random.normal(times * 0.05);
        z.reading.range_m += bias_m.at(pair) + random.normal(times * test::kRangeSigma);
      }
    };
    TeamFilter filter;
    const TeamSolution solution = test::solution_after(team, filter, 10.0);
    for (const TeamPose& pose : solution.poses) {
      sum += test::position_nees_of(pose, team.truth(pose.neighbor));
      count += 1.0;
    }
  }
  return sum / count;
}

// Three is honest.
TEST(TeamFilter, IsHonestWithRangesThatErrTwiceAsMuch) {
  EXPECT_LT(mean_nees(0.0), 4.5);
  EXPECT_LT(mean_nees(2.0), 6.0);
}

}  // namespace
}  // namespace crepes::range_scatter_test
