/// Swarms with faults on virtual time: the campaign of tests/faults.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "tests/faults/in_child.hpp"
#include "tests/faults/kept.hpp"
#include "tests/faults/network_faults.hpp"
#include "tests/faults/shrink.hpp"
#include "tests/faults/trial.hpp"
#include "tests/study/simulated_swarm.hpp"
#include "tests/support/live_daemon.hpp"

namespace crepes::faults_test {
namespace {

using faults::Fault;
using faults::Kind;
using faults::Pair;
using faults::PoseTrace;
using faults::Promise;
using faults::Trial;
using faults::Verdict;

std::string text_of(const Verdict& verdict) {
  std::string text =
      kept_line(verdict) + "\nsmallest: " + to_string(Trial{verdict.trial.world, verdict.smallest});
  for (const faults::Broken& one : verdict.broken) text += "\n  " + one.text;
  return text;
}

/// What kept.txt allows to each of its schedules.
class Known {
 public:
  Known() {
    for (const faults::KeptTrial& kept : faults::kept_trials())
      allowed_[to_string(kept.trial)] = kept.allowed;
  }
  [[nodiscard]] std::vector<std::string> unexpected(const Verdict& verdict) const {
    return faults::unexpected(verdict, allowed_for(verdict));
  }
  /// No schedule is worse than it may be. Prints which of the open ones are kept here.
  void expect_of(const std::vector<Trial>& trials) const {
    std::size_t judged = 0;
    faults::try_all(
        trials,
        [&](const Verdict& verdict) {
          ++judged;
          for (const std::string& line : unexpected(verdict))
            ADD_FAILURE() << line << '\n' << text_of(verdict);
          for (const std::string& line : faults::kept_again(verdict, allowed_for(verdict)))
            std::cout << line << '\n';
        },
        [&](const Verdict& verdict) { return !unexpected(verdict).empty(); });
    EXPECT_EQ(judged, trials.size());
  }

 private:
  using Allowed = std::map<faults::Promise, double>;

  [[nodiscard]] Allowed allowed_for(const Verdict& verdict) const {
    const auto known = allowed_.find(to_string(verdict.trial));
    return known == allowed_.end() ? Allowed{} : known->second;
  }

  std::map<std::string, Allowed> allowed_;
};

constexpr std::uint64_t kWorlds = 10;
/// Of the seeds of each world; the others are flown by faults/run.sh.
constexpr std::uint64_t kSeeds = kIsSanitized ? 2 : faults::kSeedsPerWorld / 2;

std::vector<Trial> trials_of_world(std::uint64_t world) {
  std::vector<Trial> trials;
  for (std::uint64_t i = 1; i <= kSeeds; ++i)
    trials.push_back(faults::trial_of(world * faults::kSeedsPerWorld + i, faults::kShort));
  return trials;
}

/// A world, and half of its seeds. One process for each, so that they run side by side.
class Faults : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Faults, LeaveTheOthersHonestAndEndWithTheirCause) {
  Known().expect_of(trials_of_world(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Worlds, Faults, testing::Range(std::uint64_t{0}, kWorlds));

/// Those that are not flown above, in parts that run side by side; half of the parts, because all
/// take two minutes of two cores. `fault_campaign --kept` flies all.
class KeptFaults : public testing::TestWithParam<std::size_t> {};
constexpr std::size_t kParts = 4;

TEST_P(KeptFaults, AreStillMended) {
  if (kIsSanitized) GTEST_SKIP() << "the worlds above reach the same code";
  std::set<std::string> flown;
  for (std::uint64_t world = 0; world < kWorlds; ++world)
    for (const Trial& trial : trials_of_world(world)) flown.insert(to_string(trial));
  std::map<std::string, std::vector<Trial>> by_world;
  for (const faults::KeptTrial& kept : faults::kept_trials())
    if (!flown.contains(to_string(kept.trial)))
      by_world[to_string(kept.trial.world)].push_back(kept.trial);
  const Known known;
  for (std::size_t i = 0; const auto& [world, trials] : by_world)
    if (i++ % kParts == GetParam()) known.expect_of(trials);
}

INSTANTIATE_TEST_SUITE_P(Parts, KeptFaults, testing::Range(std::size_t{0}, kParts / 2));

TEST(KeptTrial, MayBreakTheirPromiseNoWorseThanTheirLineSays) {
  const auto kept =
      faults::parse_kept("open error 0.09 present 1.2 four 4 open: loss r1 4 5 1 5  # why").value();
  Verdict verdict;
  verdict.trial = kept.trial;
  const auto count = [&](std::vector<faults::Broken> broken) {
    verdict.broken = std::move(broken);
    return faults::unexpected(verdict, kept.allowed).size();
  };
  const auto count_kept = [&] { return faults::kept_again(verdict, kept.allowed).size(); };

  EXPECT_TRUE(kept.is_open());
  EXPECT_EQ(count({{Promise::kError, 0.09, ""}, {Promise::kPresent, 0.8, ""}}), 0U);
  EXPECT_EQ(count_kept(), 0U);
  EXPECT_EQ(count({{Promise::kError, 0.10, ""}, {Promise::kPresent, 0.8, ""}}), 1U);  // worse
  EXPECT_EQ(count({{Promise::kPresent, 0.8, ""}}), 0U);
  EXPECT_EQ(count_kept(), 1U);
  EXPECT_EQ(count({{Promise::kError, 0.09, ""},
                   {Promise::kPresent, 0.8, ""},
                   {Promise::kRuns, 1, ""},
                   {Promise::kFinite, 3, ""}}),
            2U);  // never allowed
  EXPECT_EQ(count({{Promise::kError, std::nan(""), ""}, {Promise::kPresent, 0.8, ""}}), 1U);

  verdict.broken = {{Promise::kError, 0.04, ""}, {Promise::kError, 0.08, ""}};
  const auto again = faults::parse_kept(faults::kept_line(verdict)).value();
  EXPECT_EQ(to_string(again.trial), to_string(kept.trial));
  EXPECT_EQ(again.allowed, (std::map<Promise, double>{{Promise::kError, 0.1}}));
  EXPECT_FALSE(faults::parse_kept("four 4 open: loss r1 4 5 1 5").value().is_open());
  EXPECT_FALSE(faults::parse_kept("open four 4 open: loss r1 4 5 1 5"));
  EXPECT_FALSE(faults::parse_kept("open manners 3 four 4 open: loss r1 4 5 1 5"));
}

/// What breaks: a fault of the second robot that lasts at least half a second at a rate of 0.4.
TEST(FaultSchedule, ShrinksToWhatStillGoesWrong) {
  std::vector<Fault> faults{
      {.kind = Kind::kLoss, .robot = RobotId{1}, .from_s = 5, .to_s = 9},
      {.kind = Kind::kLoss, .robot = RobotId{2}, .from_s = 5, .to_s = 9, .rate = 0.96},
      {.kind = Kind::kReboot, .robot = RobotId{3}, .from_s = 5, .to_s = 9}};
  int tried = 0;
  const auto breaks = [&](const std::vector<Fault>& schedule) {
    ++tried;
    return std::ranges::any_of(schedule, [](const Fault& fault) {
      return fault.robot == RobotId{2} && fault.to_s - fault.from_s >= 0.5 && fault.rate >= 0.4;
    });
  };

  const std::vector<Fault> smallest = faults::shrunk(faults, breaks);

  ASSERT_EQ(smallest.size(), 1U);
  EXPECT_EQ(to_string(smallest.front()), "loss r2 5.000 5.500 0.48 0");
  EXPECT_LE(tried, 3 + 8);
  EXPECT_EQ(faults::shrunk(faults, [](const auto&) { return false; }).size(), 3U);
}

TEST(FaultTrial, IsTheSameToTheBitWhenRepeated) {
  const study::Swarm swarm = study::simulate_swarm(study::kScenarios[2], 3, 8.0);
  std::vector<Fault> all;
  for (const faults::KindOf& kind : faults::kKinds)
    all.push_back({.kind = kind.kind,
                   .robot = kind.kind == Kind::kKilled ? RobotId{4} : RobotId{2},
                   .from_s = 4.0,
                   .to_s = 4.5,
                   .seed = 7});
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

  // One of so many poses; off by 10 sigma for 1 s but for an honest one every `pause_s`.
  const auto every = [](int nth, double sigma_m = 0.02, double pause_s = 0.0) {
    PoseTrace trace;
    NeighborPose pose;
    pose.T_B_N.covariance = sigma_m * sigma_m * Matrix6d::Identity();
    for (int i = 200; i < 700; i += nth) {
      const double t = 0.02 * i;
      const bool is_wrong = pause_s > 0.0 && t > 6.0 && t < 7.0 && std::fmod(t, pause_s) > 0.02;
      pose.T_B_N.pose.p.x() = is_wrong ? 10.0 * sigma_m : 0.0;
      trace.add(pose, Pose{}, t);
    }
    return trace;
  };

  EXPECT_EQ(count(Kind::kLoss, trace_of(0.05, 0.02)), 0U);
  EXPECT_EQ(count(Kind::kLoss, not_finite), 1U);
  EXPECT_EQ(count(Kind::kLoss, trace_of(0.06, 0.008)), 1U);                // beyond 5 sigma
  EXPECT_EQ(count(Kind::kImuStuck, trace_of(0.06, 0.008, 4.0, 9.9)), 1U);  // excused; then absent
  EXPECT_EQ(count(Kind::kImuStuck, trace_of(0.06, 0.008)), 1U);        // excused until it recovers
  EXPECT_EQ(count(Kind::kLoss, trace_of(0.08, 0.1)), 1U);              // error after the recovery
  EXPECT_EQ(count(Kind::kLoss, trace_of(0.02, 0.02, 4.0, 12.0)), 1U);  // no pose
  EXPECT_EQ(count(Kind::kLoss, every(2)), 1U);                         // half of the poses
  EXPECT_EQ(count(Kind::kLoss, every(1, 3.0)), 1U);                    // that nobody should use
  EXPECT_EQ(count(Kind::kLoss, every(1, 0.02, 0.4)), 1U);  // beyond 5 sigma, with honest ones
  EXPECT_EQ(count(Kind::kLoss, every(1)), 0U);
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

TEST(FaultTrial, JudgesTheAttitudeToo) {
  PoseTrace turned;
  NeighborPose pose;
  pose.T_B_N.pose.q = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ());
  pose.T_B_N.covariance = 0.01 * 0.01 * Matrix6d::Identity();
  for (double t = 5.0; t < 6.0; t += 0.02) turned.add(pose, Pose{}, t);

  EXPECT_NEAR(turned.beyond({5.0, 6.0}).longest_s, 1.0, 0.05);
  EXPECT_NEAR(turned.beyond({5.0, 6.0}).worst_rad, 0.1, 1e-9);
  EXPECT_NEAR(turned.rmse_rad({5.0, 6.0}), 0.1, 1e-9);
  EXPECT_EQ(turned.rmse_m({5.0, 6.0}), 0.0);
}

TEST(FaultTrial, ExpectsNothingOfARobotThatWasKilledButHonesty) {
  const Pair pair{RobotId{1}, RobotId{2}};
  const std::vector<Fault> killed{
      {.kind = Kind::kKilled, .robot = RobotId{2}, .from_s = 5.0, .to_s = 8.0}};
  const auto count = [&](const PoseTrace& trace) {
    return broken_promises(killed, {{pair, trace}}, {{pair, trace_of(0.02, 0.02)}}).size();
  };

  EXPECT_EQ(count(trace_of(0.02, 0.02, 4.0, 6.0)), 0U);  // absent from then on
  EXPECT_EQ(count(trace_of(0.02, 0.02)), 0U);
  EXPECT_EQ(count(trace_of(0.2, 0.02)), 2U);  // beyond 5 sigma, and so after it is gone
}

TEST(FaultTrial, ReplaysASessionThatHasEnded) {
  const study::Swarm swarm = study::simulate_swarm(study::kScenarios[2], 3, 9.0);
  const auto refused = [&](Kind kind, MeshCounter counter) {
    faults::Flight flight(swarm, true);
    flight.fly_until(4.9);
    flight.strike({{.kind = kind, .robot = RobotId{2}, .from_s = 5.0, .to_s = 8.5, .seed = 7}});
    flight.fly_until(8.6);
    EXPECT_EQ(flight.complaints(), std::vector<std::string>());
    return flight.counters(RobotId{1})[counter];
  };

  EXPECT_GT(refused(Kind::kReplayedSession, MeshCounter::kRefusedOldSession), 100U);
  EXPECT_EQ(refused(Kind::kReplay, MeshCounter::kRefusedOldSession), 0U);
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
}  // namespace crepes::faults_test
