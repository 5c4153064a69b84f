// Robots that carry each other's UWB module.
#include "estimator/swarm/swapped_modules.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/estimator_pair.hpp"

namespace crepes::swapped_modules_test {
namespace {

using namespace std::chrono_literals;
using test::Conditions;
using test::EstimatorPair;

constexpr RobotId kRobot{3};
constexpr double kFar = 3.0;  // m, to where the module is

UwbRange range_to(RobotId neighbor, Duration at) {
  return {.stamp = Timestamp{at}, .neighbor = neighbor, .range_m = kFar};
}

TEST(SwappedModules, AreThoseOfRobotsThatMeasureRangesToThemselves) {
  SwappedModules modules;
  for (const Duration at : {1s, 2s, 3s, 4s}) modules.add(kRobot, range_to(RobotId{1}, at));
  EXPECT_FALSE(modules.contains(kRobot, Timestamp{4s}));
  EXPECT_FALSE(modules.fault_of(kRobot, Timestamp{4s}));

  for (const Duration at : {1s, 2s, 3s}) {
    EXPECT_FALSE(modules.contains(kRobot, Timestamp{4s})) << "one may be damaged";
    modules.add(kRobot, range_to(kRobot, at));
  }
  EXPECT_TRUE(modules.contains(kRobot, Timestamp{4s}));
  EXPECT_FALSE(modules.contains(RobotId{1}, Timestamp{4s}));
  EXPECT_EQ(modules.fault_of(kRobot, Timestamp{4s}),
            (TeamFault{kRobot, TeamFault::Kind::kModule, kFar}));
}

TEST(SwappedModules, AreForgottenWhenTheyAreOnTheirRobots) {
  SwappedModules modules;
  for (const Duration at : {1s, 2s, 3s}) modules.add(kRobot, range_to(kRobot, at));
  EXPECT_TRUE(modules.contains(kRobot, Timestamp{13s}));
  EXPECT_FALSE(modules.contains(kRobot, Timestamp{13s + 1ms}));
  for (const Duration at : {20s, 21s}) modules.add(kRobot, range_to(kRobot, at));
  EXPECT_FALSE(modules.contains(kRobot, Timestamp{21s})) << "counted anew";
}

/// What a third robot's module does to a pair: ours and the neighbor's ranges to `swapped` end at
/// that robot, and `swapped` measures the distance to its own id.
Conditions with_swapped(RobotId swapped) {
  Conditions with;
  const auto mend = [swapped](UwbRange& range) {
    if (range.neighbor == swapped) range.range_m += kFar;
  };
  with.range = mend;
  if (swapped == EstimatorPair::kOther) {
    with.peer_report = [](Report& report) {
      report.ranges.push_back({report.stamp, EstimatorPair::kOther, kFar, -80.0, -79.0});
    };
  }
  return with;
}

/// The largest error of poses of the last two of five seconds.
double worst_m(const EstimatorPair& pair) {
  double worst = 0.0;
  for (const EstimatorPair::Found& found : pair.found())
    if (found.at > 3s) worst = std::max(worst, found.error.head<3>().norm());
  return worst;
}

TEST(SwappedModules, OfANeighborCostOnlyTheRangesToIt) {
  int good = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    EstimatorPair pair(seed);
    pair.run_for(5s, with_swapped(EstimatorPair::kOther));

    ASSERT_EQ(pair.status().faults.size(), 1U);
    EXPECT_EQ(pair.status().faults[0].kind, TeamFault::Kind::kModule);
    EXPECT_TRUE(pair.estimator_status().faults.empty());
    EXPECT_GT(pair.count(MeasurementKind::kRange, Verdict::kGated), 100U);
    const bool has_poses = pair.found().size() > 150 && worst_m(pair) < 0.5;
    good += has_poses && pair.count(MeasurementKind::kPeerRange, Verdict::kFused) > 50 ? 1 : 0;
  }
  EXPECT_GE(good, 32) << "the first ranges mislead the start of some";
}

// Two damaged frames are no evidence, whatever else their reports contain.
TEST(SwappedModules, AReportIsCountedOnce) {
  EstimatorSettings settings = EstimatorPair(1).settings();
  MemberConfig third = settings.swarm.members[1];
  third.id = kRobot;
  third.pattern = "000110111111111111";
  settings.swarm.members.push_back(third);
  Estimator estimator(settings);
  Timestamp now{10s};
  const auto hear = [&](RobotId sender, std::initializer_list<RobotId> measured) {
    now += 100ms;
    ReceivedReport received;
    received.report.sender = sender;
    received.report.stamp = now;
    for (const RobotId neighbor : measured)
      received.report.ranges.push_back({now, neighbor, kFar, -80.0, -79.0});
    static_cast<void>(estimator.step(received));
  };
  const RobotId other = EstimatorPair::kOther;
  for (int i = 0; i < 3; ++i) hear(other, {other});
  for (int i = 0; i < 2; ++i) hear(kRobot, {kRobot, other});
  static_cast<void>(estimator.step(Tick{now}));
  const EstimatorStatus status = estimator.status();
  EXPECT_EQ(status.neighbors.at(0).faults.size(), 1U);
  EXPECT_TRUE(status.neighbors.at(1).faults.empty());
}

// Our own module is another's: the neighbor's ranges to us are to that robot.
TEST(SwappedModules, OfOursAreToldToTheOthers) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    EstimatorPair pair(seed);
    Conditions with = with_swapped(EstimatorPair::kSelf);
    std::size_t told = 0;
    with.own_report = [&told](const Report& report) {
      told += std::ranges::count(report.ranges, EstimatorPair::kSelf, &UwbRange::neighbor) > 0;
    };
    for (int i = 0; i < 250; ++i) {
      pair.measure({pair.own_time(pair.now()), EstimatorPair::kSelf, kFar, -80.0, -79.0});
      pair.run_for(20ms, with);
    }

    ASSERT_EQ(pair.estimator_status().faults.size(), 1U);
    EXPECT_EQ(pair.estimator_status().faults[0].kind, TeamFault::Kind::kModule);
    EXPECT_TRUE(pair.status().faults.empty());
    EXPECT_GT(told, 200U);
    EXPECT_GT(pair.count(MeasurementKind::kRange, Verdict::kFused), 50U);
    EXPECT_GT(pair.count(MeasurementKind::kPeerRange, Verdict::kGated), 100U);
    EXPECT_GT(pair.found().size(), 200U);
    EXPECT_LT(worst_m(pair), 0.5);
  }
}

}  // namespace
}  // namespace crepes::swapped_modules_test
