// What the tight filter costs, to be read against BM_MatrixProduct of the same run: the product of
// two matrices of its covariance's size.
#include <benchmark/benchmark.h>

#include <limits>
#include <optional>
#include <vector>

#include "estimator/graph/pose_graph.hpp"
#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/neighbor.hpp"
#include "estimator/team/team_filter.hpp"
#include "estimator/team/unseen/unseen_robots.hpp"
#include "tests/support/simulated_belief.hpp"
#include "tests/support/simulated_pair.hpp"
#include "tests/support/simulated_team.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;
using test::SimulatedPair;

constexpr double kNoGate = std::numeric_limits<double>::infinity();

void BM_MatrixProduct(benchmark::State& state) {
  ErrorState::Covariance::Full A = ErrorState::Covariance::Full::Random();
  ErrorState::Covariance::Full B = ErrorState::Covariance::Full::Random();
  ErrorState::Covariance::Full C;
  for (auto _ : state) {
    benchmark::DoNotOptimize(A.data());
    benchmark::DoNotOptimize(B.data());
    C.noalias() = A * B;
    benchmark::DoNotOptimize(C.data());
  }
}

/// Two seconds of flight, and a filter of its beginning.
struct Flight {
  SimulatedPair pair{1};
  Timestamp start{1s};

  Flight() { pair.sample_imus(Timestamp{2s}); }

  [[nodiscard]] NeighborFilter filter() {
    const auto raw = std::get<RawPose>(compute_raw_pose(pair.sighting(start)));
    return {start, raw, pair.process_noise(), pair.priors()};
  }
};

/// One sample of both robots: 10 ms.
void BM_ImuStep(benchmark::State& state) {
  Flight flight;
  const NeighborFilter first = flight.filter();
  NeighborFilter filter = first;
  for (auto _ : state) {
    if (filter.stamp() >= Timestamp{1900ms}) filter = first;
    filter.advance_to(filter.stamp() + 10ms, flight.pair.imu_B, flight.pair.imu_N);
    benchmark::DoNotOptimize(filter);
  }
}

/// Corrects a filter that has settled, with the same reading again and again.
template <class Fuse>
void correct(benchmark::State& state, Flight& flight, const Fuse& fuse) {
  NeighborFilter filter = flight.filter();
  for (int i = 0; i < 100; ++i) fuse(filter);
  for (auto _ : state) benchmark::DoNotOptimize(fuse(filter));
}

void BM_FuseBearing(benchmark::State& state) {
  Flight flight;
  const DirectionReading z = flight.pair.bearing(flight.start);
  correct(state, flight, [&](NeighborFilter& filter) {
    return filter.fuse_bearing(z, flight.pair.mounting_N.led, kNoGate);
  });
}

void BM_FuseRange(benchmark::State& state) {
  Flight flight;
  const RangeReading z = flight.pair.range(flight.start);
  correct(state, flight, [&](NeighborFilter& filter) {
    return filter.fuse_range(z, flight.pair.mounting_B.antenna, flight.pair.mounting_N.antenna,
                             kNoGate);
  });
}

constexpr RobotId kSelf{1};
constexpr RobotId kOther{2};

/// What reaches a robot of one neighbor in 20 ms at full rate: four own bearings, one of the
/// neighbor's, half a range of either, two samples of either IMU.
struct Arrivals {
  std::vector<ImuSample> imu;
  Tilt tilt;
  std::vector<Bearing> bearings;
  std::optional<UwbRange> range;
  ReceivedReport report;

  Arrivals(SimulatedPair& pair, Timestamp now) {
    pair.sample_imus(now);
    const Timestamp sent = now - 20ms;
    const MutualSighting sighting = pair.sighting(now);
    const auto newest_two = [](const ImuHistory& history, std::size_t skip) {
      const std::size_t end = history.size() - std::min(skip, history.size());
      std::vector<ImuSample> samples;
      for (std::size_t i = end < 2 ? 0 : end - 2; i < end; ++i) samples.push_back(history[i]);
      return samples;
    };
    const auto bearing = [](Timestamp stamp, RobotId whom, const DirectionReading& u) {
      return Bearing{stamp, whom, u.u, u.camera, u.sigma_rad};
    };
    const auto range_at = [&](Timestamp stamp, RobotId whom) {
      return UwbRange{stamp, whom, pair.range(stamp).range_m, -80.0, -79.0};
    };
    imu = newest_two(pair.imu_B, 0);
    tilt = {now, sighting.B.up, 0.01};
    for (const Duration ago : {15ms, 10ms, 5ms, 0ms})
      bearings.push_back(bearing(now - ago, kOther, pair.bearing(now - ago)));
    report.report.sender = kOther;
    report.report.stamp = sent;
    report.report.tilt = {sent, sighting.N.up, 0.01};
    report.report.imu = newest_two(pair.imu_N, 2);
    report.report.bearings = {bearing(sent, kSelf, pair.peer_bearing(sent))};
    if (now.time_since_epoch() % 40ms == 0ms) {
      range = range_at(now, kOther);
      report.report.ranges = {range_at(now - 15ms, kSelf)};
    }
  }
};

MemberConfig member(RobotId id, const Mounting& mounting) {
  MemberConfig config;
  config.id = id;
  config.p_body_led = mounting.led;
  config.p_body_uwb = mounting.antenna;
  return config;
}

/// 20 ms of so many neighbors, their poses included.
void BM_NeighborTick(benchmark::State& state) {
  SimulatedPair pair(1);
  const Neighbor first(member(kSelf, pair.mounting_B), member(kOther, pair.mounting_N),
                       filter_settings({}));
  std::vector<Neighbor> neighbors(static_cast<std::size_t>(state.range(0)), first);
  RobotState self;
  Timestamp now{};
  const auto next_arrivals = [&] {
    now += 20ms;
    Arrivals arrivals(pair, now);
    for (const ImuSample& sample : arrivals.imu) self.imu.push(sample);
    self.tilt = arrivals.tilt;
    return arrivals;
  };
  const auto tick = [&](const Arrivals& arrivals) {
    for (Neighbor& neighbor : neighbors) {
      for (const Bearing& bearing : arrivals.bearings) neighbor.add(bearing);
      if (arrivals.range) neighbor.add(*arrivals.range);
      neighbor.add_report(arrivals.report, self);
      neighbor.tick(now, self);
    }
  };
  while (now < Timestamp{2s}) tick(next_arrivals());  // the first second is on trial
  for (auto _ : state) {
    state.PauseTiming();
    const Arrivals arrivals = next_arrivals();
    state.ResumeTiming();
    tick(arrivals);
  }
  if (!neighbors.back().output().pose()) state.SkipWithError("no pose");
  state.SetComplexityN(state.range(0));
}

/// An interval of 0.1 s of a team in which everybody sees everybody; its filter estimates at most
/// twelve jointly.
void BM_TeamFilter(benchmark::State& state) {
  test::SimulatedTeam team(1, static_cast<int>(state.range(0)));
  TeamFilter filter;
  for (int i = 0; i < 15; ++i) benchmark::DoNotOptimize(filter.step(team.next()));
  for (auto _ : state) {
    state.PauseTiming();
    const TeamInterval interval = team.next();
    state.ResumeTiming();
    benchmark::DoNotOptimize(filter.step(interval));
  }
}

/// A robot that nobody sees is placed by 5 s of ranges to six others.
void BM_UnseenRobot(benchmark::State& state) {
  static constexpr RobotId kUnseen{4};
  test::SimulatedTeam team(2, 7);
  team.hovers = true;
  team.sees = [](RobotId i, RobotId j) { return i != kUnseen && j != kUnseen; };
  UnseenRobots unseen;
  test::TrueMotions motions = test::motions_of(team);
  TeamInterval interval = team.next();
  for (int i = 0; i < 56; ++i) {
    unseen.add(interval, test::true_belief(motions, interval));
    motions = test::motions_of(team);
    if (i < 55) interval = team.next();
  }
  const TeamBelief belief = test::true_belief(motions, interval);
  if (!unseen.places(interval, belief).contains(kUnseen)) state.SkipWithError("no place");
  for (auto _ : state) benchmark::DoNotOptimize(unseen.places(interval, belief));
}

/// The pose graph of the same team.
void BM_PoseGraph(benchmark::State& state) {
  test::SimulatedTeam team(1, static_cast<int>(state.range(0)));
  const TeamInterval interval = team.next();
  const GraphProblem problem{interval.to, interval.self, interval.edges};
  for (auto _ : state) benchmark::DoNotOptimize(solve_pose_graph(problem, GraphConfig{}));
}

BENCHMARK(BM_UnseenRobot)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_TeamFilter)->Arg(5)->Arg(10)->Arg(20)->Arg(50)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_PoseGraph)->Arg(5)->Arg(10)->Arg(20)->Arg(50)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_MatrixProduct)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_ImuStep)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_FuseBearing)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_FuseRange)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_NeighborTick)
    ->Unit(benchmark::kMicrosecond)
    ->Arg(1)
    ->Arg(5)
    ->Arg(20)
    ->Complexity(benchmark::oN);

}  // namespace
}  // namespace crepes
