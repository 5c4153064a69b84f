/// Robots that leave, restart, join or meet others cost nobody else a pose.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "daemon/ctl/replay/virtual_swarm.hpp"
#include "tests/faults/pose_trace.hpp"
#include "tests/study/crowd.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes::study::team_changes_test {
namespace {

using faults::PoseTrace;
using faults::Span;
using Traces = std::map<std::pair<RobotId, RobotId>, PoseTrace>;

/// At this time a robot is switched on or off.
struct Switch {
  double at_s = 0.0;
  RobotId robot{};
  bool is_on = false;
};

/// Switches are in the order of time.
Traces flown(const Swarm& swarm, const ReplayOptions& options, const std::vector<Switch>& switches,
             double duration_s) {
  Traces traces;
  const std::optional<SwarmTruth> truth = swarm.truth;
  ReplaySinks sinks;
  VirtualSwarm flight(swarm.dataset, truth, options, sinks);
  sinks.on_pose = [&](RobotId observer, const NeighborPose& pose) {
    const auto T = swarm.truth.relative(observer, pose.neighbor, pose.stamp);
    if (T) traces[{observer, pose.neighbor}].add(pose, *T, flight.now_s());
  };
  for (const Switch& change : switches) {
    EXPECT_TRUE(flight.run_until(change.at_s).has_value());
    change.is_on ? flight.switch_on(change.robot) : flight.switch_off(change.robot);
  }
  EXPECT_TRUE(flight.run_until(duration_s).has_value());
  return traces;
}

/// Root mean square over all ordered pairs of these robots.
double rmse_m(const Traces& traces, const std::set<RobotId>& robots, const Span& span) {
  double sum = 0.0;
  double pairs = 0.0;
  for (const auto& [pair, trace] : traces) {
    if (!robots.contains(pair.first) || !robots.contains(pair.second)) continue;
    sum += std::pow(trace.rmse_m(span), 2);
    pairs += 1.0;
  }
  return std::sqrt(sum / pairs);
}

constexpr double kFactor = 1.5;     // of the errors without the change
constexpr double kNoAbsence = 0.1;  // s

/// All ordered pairs of these robots have poses all the time, and none is beyond five sigma.
void expect_poses(const Traces& traces, const std::set<RobotId>& robots, const Span& span) {
  for (const RobotId from : robots) {
    for (const RobotId to : robots) {
      if (from == to) continue;
      ASSERT_TRUE(traces.contains({from, to})) << from.value << " of " << to.value;
      const PoseTrace& trace = traces.at({from, to});
      EXPECT_LT(trace.longest_absence_s(span), kNoAbsence) << from.value << " of " << to.value;
      EXPECT_EQ(trace.beyond(span).longest_s, 0.0) << from.value << " of " << to.value;
    }
  }
}

class TeamOfFour : public testing::Test {
 protected:
  static constexpr double kDuration = 14.0;  // s
  static constexpr double kChange = 7.0;     // s
  static constexpr RobotId kFourth{4};
  static constexpr Span kAfterChange{kChange, kDuration};

  [[nodiscard]] Traces with(const std::vector<Switch>& switches) const {
    return flown(swarm_, {}, switches, kDuration);
  }
  /// Compared with the same flight without the change.
  void expect_no_harm(const Traces& traces, const Traces& without) const {
    expect_poses(traces, others_, kAfterChange);
    EXPECT_LT(rmse_m(traces, others_, kAfterChange),
              kFactor * rmse_m(without, others_, kAfterChange));
  }

  const Swarm swarm_ = simulate_swarm(
      *std::ranges::find(kScenarios, std::string_view("four"), &Scenario::name), 1, kDuration);
  const std::set<RobotId> others_{RobotId{1}, RobotId{2}, RobotId{3}};
};

TEST_F(TeamOfFour, LosesNoPoseByARobotThatLeavesOrRestarts) {
  const Traces all = with({});
  expect_no_harm(with({{kChange, kFourth, false}}), all);

  const Traces restarted = with({{kChange, kFourth, false}, {kChange + 1.0, kFourth, true}});
  expect_no_harm(restarted, all);
  const Span in_the_end{kChange + 4.0, kDuration};
  expect_poses(restarted, {RobotId{1}, RobotId{2}, RobotId{3}, kFourth}, in_the_end);
}

TEST_F(TeamOfFour, LosesNoPoseByARobotThatJoins) {
  const Traces joined = with({{0.0, kFourth, false}, {kChange, kFourth, true}});
  expect_no_harm(joined, with({{0.0, kFourth, false}}));
  const Span in_the_end{kChange + 4.0, kDuration};
  expect_poses(joined, {RobotId{1}, RobotId{2}, RobotId{3}, kFourth}, in_the_end);
}

// Out of each other's sight and reach at first.
TEST(TwoGroups, ThatMeetBecomeOne) {
  constexpr double kMeeting = 12.0;  // s
  constexpr double kDuration = 15.0;
  const Swarm swarm = simulate_crowd({.robots = 5,
                                      .rings = 2,
                                      .radius_m = 3.0,
                                      .distance_m = 30.0,
                                      .nearest_m = 8.0,
                                      .meeting_s = kMeeting,
                                      .sight_m = 13.0},
                                     1, kDuration);
  const std::set<RobotId> first{RobotId{1}, RobotId{3}, RobotId{5}};
  const std::set<RobotId> second{RobotId{2}, RobotId{4}};
  ReplayOptions options;
  options.reach_m = 14.0;
  const Traces met = flown(swarm, options, {}, kDuration);
  const Traces alone =
      flown(swarm, options, {{0.0, RobotId{2}, false}, {0.0, RobotId{4}, false}}, kDuration);

  for (const auto& [pair, trace] : met) {
    if (first.contains(pair.first) != first.contains(pair.second)) {
      EXPECT_GT(trace.errors().front().true_s, 6.0);
    }
  }
  const Span together{8.0, kDuration};
  expect_poses(met, first, together);
  expect_poses(met, second, together);
  EXPECT_LT(rmse_m(met, first, together), kFactor * rmse_m(alone, first, together));
  for (const RobotId a : first) {
    for (const RobotId b : second) {
      for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
        ASSERT_TRUE(met.contains({from, to})) << from.value << " of " << to.value;
        const Span in_the_end{kMeeting + 1.0, kDuration};
        EXPECT_LT(met.at({from, to}).longest_absence_s(in_the_end), 0.3)
            << from.value << " of " << to.value;
        EXPECT_EQ(met.at({from, to}).beyond({0.0, kDuration}).longest_s, 0.0)
            << from.value << " of " << to.value;
      }
    }
  }
}

/// Board and camera of robot 6 are covered from then on: the others' poses of it, and its own poses
/// of them.
void expect_poses_of_covered(double from_s, const Span& known, double most_rmse_m) {
  constexpr RobotId kCovered{6};
  const double duration_s = known.to_s;
  const Swarm swarm =
      simulate_crowd({.robots = 6,
                      .rings = 1,
                      .radius_m = 5.0,
                      .spread_m = 4.0,
                      .dark = {.from_s = from_s, .to_s = duration_s, .robot = kCovered}},
                     1, duration_s);
  const Traces traces = flown(swarm, {}, {}, duration_s);
  for (std::uint16_t i = 1; i < kCovered.value; ++i) {
    for (const auto& [from, to] : {std::pair{RobotId{i}, kCovered}, {kCovered, RobotId{i}}}) {
      SCOPED_TRACE(fmt::format("r{} of r{}", to.value, from.value));
      const auto trace = traces.find({from, to});
      ASSERT_NE(trace, traces.end());
      EXPECT_LT(trace->second.longest_absence_s(known), 0.3);
      EXPECT_LT(trace->second.rmse_m(known), most_rmse_m);
      EXPECT_EQ(trace->second.beyond({0.0, duration_s}).longest_s, 0.0);
    }
  }
}

TEST(UnseenRobot, HasAPoseByRangesAlone) { expect_poses_of_covered(0.0, {10.0, 12.0}, 0.5); }

TEST(UnseenRobot, GoesOnFromWhatWasKnown) { expect_poses_of_covered(5.0, {5.0, 20.0}, 0.3); }

}  // namespace
}  // namespace crepes::study::team_changes_test
