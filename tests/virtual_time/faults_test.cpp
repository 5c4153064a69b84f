/// Swarms with faults on virtual time: the campaign of tests/faults.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "tests/faults/in_child.hpp"
#include "tests/faults/trial.hpp"
#include "tests/study/simulated_swarm.hpp"
#include "tests/support/live_daemon.hpp"
#include "tests/support/places.hpp"

namespace crepes {
namespace {

using faults::Fault;
using faults::Kind;
using faults::Pair;
using faults::PoseTrace;
using faults::Trial;
using faults::Verdict;

std::string text_of(const Verdict& verdict) {
  std::string text = to_string(verdict.trial) +
                     "\nsmallest: " + to_string(Trial{verdict.trial.world, verdict.smallest});
  for (const std::string& line : verdict.broken) text += "\n  " + line;
  return text;
}

struct KeptTrial {
  Trial trial;
  std::string text;      ///< as it is printed
  bool is_open = false;  ///< still breaks a promise
};

/// tests/faults/kept.txt
std::vector<KeptTrial> kept_trials() {
  std::vector<KeptTrial> kept;
  std::ifstream file(source_dir() + "/tests/faults/kept.txt");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line.starts_with('#')) continue;
    const bool is_open = line.starts_with("open ");
    const auto trial = faults::parse_trial(is_open ? line.substr(5) : line);
    EXPECT_TRUE(trial) << line;
    if (trial) kept.push_back({*trial, to_string(*trial), is_open});
  }
  return kept;
}

void expect(const Verdict& verdict, bool is_open) {
  if (!is_open) {
    EXPECT_TRUE(verdict.broken.empty()) << text_of(verdict);
  } else {
    std::printf("known, %s: %s\n", verdict.broken.empty() ? "and holds now" : "and still fails",
                text_of(verdict).c_str());
  }
}

constexpr std::uint64_t kWorlds = 10;
constexpr std::uint64_t kSeeds = kIsSanitized ? 2 : faults::kSeedsPerWorld;  // of each world

/// A world, and all of its seeds. One process for each, so that they run side by side.
class Faults : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Faults, LeaveTheOthersHonestAndEndWithTheirCause) {
  std::vector<Trial> trials;
  for (std::uint64_t i = 1; i <= kSeeds; ++i)
    trials.push_back(faults::trial_of(GetParam() * faults::kSeedsPerWorld + i, faults::kShort));
  const std::vector<KeptTrial> kept = kept_trials();

  std::size_t judged = 0;
  faults::try_all(trials, [&](const Verdict& verdict) {
    ++judged;
    const auto known = std::ranges::find(kept, to_string(verdict.trial), &KeptTrial::text);
    expect(verdict, known != kept.end() && known->is_open);
  });
  EXPECT_EQ(judged, kSeeds);
}

INSTANTIATE_TEST_SUITE_P(Worlds, Faults, testing::Range(std::uint64_t{0}, kWorlds));

/// Those that are no seeds of the worlds above.
TEST(KeptFaults, AreStillMended) {
  if (kIsSanitized) GTEST_SKIP() << "the worlds above reach the same code";
  std::set<std::string> flown;
  for (std::uint64_t seed = 1; seed <= kWorlds * faults::kSeedsPerWorld; ++seed)
    flown.insert(to_string(faults::trial_of(seed, faults::kShort)));
  std::map<std::string, std::vector<Trial>> by_world;
  std::set<std::string> open;
  for (const KeptTrial& kept : kept_trials()) {
    if (kept.is_open) open.insert(kept.text);
    if (!flown.contains(kept.text)) by_world[to_string(kept.trial.world)].push_back(kept.trial);
  }
  for (const auto& [world, trials] : by_world)
    faults::try_all(trials, [&](const Verdict& verdict) {
      expect(verdict, open.contains(to_string(verdict.trial)));
    });
}

TEST(FaultTrial, IsTheSameToTheBitWhenRepeated) {
  const study::Swarm swarm = study::simulate_swarm(study::kScenarios[2], 3, 8.0);
  std::vector<Fault> all;
  for (const faults::KindOf& kind : faults::kKinds)
    all.push_back({.kind = kind.kind, .robot = RobotId{2}, .from_s = 4.0, .to_s = 4.5, .seed = 7});
  const auto fly = [&](const std::vector<Fault>& schedule) {
    faults::Flight flight(swarm, true);
    flight.fly_until(3.9);
    flight.strike(schedule);
    flight.fly_until(7.0);
    std::vector<std::uint64_t> hashes;
    for (const auto& [pair, trace] : flight.traces()) {
      EXPECT_EQ(trace.not_finite(), 0U);
      EXPECT_FALSE(trace.errors().empty());
      hashes.push_back(trace.hash());
    }
    EXPECT_EQ(flight.complaints(), std::vector<std::string>());
    return hashes;
  };

  const auto first = fly(all);
  EXPECT_EQ(first, fly(all));
  const auto without = fly({});
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_NE(first[i], without[i]);
}

TEST(FaultTrial, BranchesOffAFlightWithoutFaultsAsIfItHadFlownAlone) {
  const Trial trial = faults::parse_trial("four 3 open: loss r1 4.0 4.5 1.00 5").value();
  std::vector<std::uint64_t> hashes;
  const auto keep = [&](const Verdict& verdict) { hashes.push_back(verdict.hash); };
  Trial later = trial;
  later.faults.front().from_s = 4.2;

  faults::try_all({trial}, keep);
  faults::try_all({later, trial, later}, keep);

  ASSERT_EQ(hashes.size(), 4U);
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[2], hashes[3]);
  EXPECT_NE(hashes[0], hashes[2]);
}

/// Poses at 50 Hz from `from_s` to 14 s, off by `error_m` at a sigma of `sigma_m`.
PoseTrace trace_of(double error_m, double sigma_m, double from_s = 4.0, double to_s = 14.0) {
  PoseTrace trace;
  NeighborPose pose;
  pose.T_B_N.pose.p.x() = error_m;
  pose.T_B_N.covariance = sigma_m * sigma_m * Matrix6d::Identity();
  for (double t = from_s; t < to_s; t += 0.02) trace.add(pose, Pose{}, t);
  return trace;
}

TEST(FaultTrial, ReportsBrokenPromises) {
  const Pair pair{RobotId{1}, RobotId{2}};
  const auto fault = [](Kind kind) {
    return std::vector<Fault>{{.kind = kind, .robot = RobotId{2}, .from_s = 5.0, .to_s = 8.0}};
  };
  const auto count = [&](Kind kind, const PoseTrace& trace) {
    return broken_promises(fault(kind), {{pair, trace}}, {{pair, trace_of(0.02, 0.02)}}).size();
  };
  PoseTrace not_finite = trace_of(0.02, 0.02);
  NeighborPose nan;
  nan.T_B_N.covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();
  not_finite.add(nan, Pose{}, 13.99);
  // Off by 10 sigma for less than half a second, at 7.2 s.
  PoseTrace ghost = trace_of(0.02, 0.02, 4.0, 7.2);
  for (const auto& [off, from, to] : {std::tuple{0.2, 7.2, 7.3}, std::tuple{0.02, 7.3, 14.0}}) {
    NeighborPose pose;
    pose.T_B_N.pose.p.x() = off;
    pose.T_B_N.covariance = 0.02 * 0.02 * Matrix6d::Identity();
    for (double t = from; t < to; t += 0.02) ghost.add(pose, Pose{}, t);
  }

  EXPECT_EQ(count(Kind::kLoss, trace_of(0.05, 0.02)), 0U);
  EXPECT_EQ(count(Kind::kLoss, not_finite), 1U);
  EXPECT_EQ(count(Kind::kLoss, trace_of(0.06, 0.008)), 1U);                // beyond 5 sigma
  EXPECT_EQ(count(Kind::kImuStuck, trace_of(0.06, 0.008, 4.0, 9.9)), 1U);  // excused; then absent
  EXPECT_EQ(count(Kind::kImuStuck, trace_of(0.06, 0.008)), 1U);        // excused until it recovers
  EXPECT_EQ(count(Kind::kLoss, trace_of(0.08, 0.1)), 1U);              // error after the recovery
  EXPECT_EQ(count(Kind::kLoss, trace_of(0.02, 0.02, 4.0, 12.0)), 1U);  // no pose
  EXPECT_EQ(count(Kind::kLoss, ghost), 0U);
  EXPECT_EQ(count(Kind::kReboot, ghost), 1U);
}

TEST(FaultTrial, ReportsTheTimeToRecover) {
  PoseTrace trace = trace_of(0.5, 0.1, 4.0, 9.0);
  NeighborPose pose;
  for (double t = 9.0; t < 14.0; t += 0.02) trace.add(pose, Pose{}, t);

  EXPECT_NEAR(trace.recovered_at_s({8.0, 13.0}, 0.1), 9.3, 0.15);
  EXPECT_EQ(trace.recovered_at_s({10.0, 13.0}, 0.1), 10.0);
}

TEST(FaultTrial, OutlivesACrash) {
  const auto crashed = faults::in_child([]() -> std::string { std::abort(); });
  const auto well = faults::in_child([] { return std::string(100'000, 'x'); });

  EXPECT_EQ(crashed.crash, "died of signal 6");
  EXPECT_EQ(well.crash, "");
  EXPECT_EQ(well.text.size(), 100'000U);
}

TEST(FaultSchedule, CanBePrintedAndRead) {
  for (std::uint64_t seed = 1; seed < 200; ++seed) {
    const Trial trial = faults::trial_of(seed, faults::kShort);
    const auto read = faults::parse_trial(to_string(trial) + "  # why");
    ASSERT_TRUE(read);
    EXPECT_EQ(to_string(*read), to_string(trial));
  }
  EXPECT_FALSE(faults::parse_trial("four 1 open: nonsense r1 1 2 3 4"));
}

}  // namespace
}  // namespace crepes
