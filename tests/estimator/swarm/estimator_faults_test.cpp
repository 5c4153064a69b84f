// What goes wrong around a robot, and what its Estimator makes of it; properties over many seeds.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "estimator/core/constants.hpp"
#include "tests/support/estimator_pair.hpp"

namespace crepes::estimator_faults_test {
namespace {

using namespace std::chrono_literals;
using test::Conditions;
using test::EstimatorPair;
using test::RandomGeometry;

constexpr std::uint64_t kSeeds = 20;
constexpr Duration kWarmUp = 4s;

/// What was published within a time, over all seeds.
struct Tally {
  int poses = 0;
  int direct = 0;
  int dishonest = 0;  ///< beyond the 99.9 % quantile of chi-square with six degrees of freedom
  double worst_m = 0.0;
  double worst_rad = 0.0;

  void add(const EstimatorPair& pair, Duration from, Duration to) {
    constexpr double kQuantile = 22.46;
    for (const EstimatorPair::Found& found : pair.found()) {
      if (found.at <= from || found.at > to) continue;
      ++poses;
      direct += found.pose.mode == PoseMode::kDirect ? 1 : 0;
      dishonest += found.nees <= kQuantile ? 0 : 1;
      worst_m = std::max(worst_m, found.error.head<3>().norm());
      worst_rad = std::max(worst_rad, found.error.tail<3>().norm());
    }
  }
  [[nodiscard]] double dishonest_share() const { return 1.0 * dishonest / std::max(1, poses); }
};

/// Runs a warm pair of each seed through `fault` and then for two seconds with nothing wrong.
template <class Fault>
struct Trials {
  Tally during;
  Tally after;
  Tally settled;              ///< the last of the two seconds
  Duration slowest_return{};  ///< to a measured pose
  std::uint32_t restarts = 0;

  explicit Trials(const Fault& fault, std::uint64_t seeds = kSeeds) {
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      EstimatorPair pair(seed);
      pair.run_for(kWarmUp);
      const std::uint32_t starts = starts_of(pair);
      fault(pair, seed);
      const Duration over = pair.now();
      pair.run_for(2s);
      during.add(pair, kWarmUp, over);
      after.add(pair, over, over + 2s);
      settled.add(pair, over + 1s, over + 2s);
      Duration back = 2s;
      for (const EstimatorPair::Found& found : pair.found()) {
        if (found.at <= over || found.pose.mode != PoseMode::kDirect) continue;
        back = found.at - over;
        break;
      }
      slowest_return = std::max(slowest_return, back);
      restarts += starts_of(pair) - starts;
    }
  }

 private:
  /// Of the filter; there must be a pose.
  static std::uint32_t starts_of(const EstimatorPair& pair) {
    EXPECT_NE(pair.latest(), nullptr);
    return pair.latest() == nullptr ? 0 : pair.latest()->pose.reset_counter;
  }
};

void do_nothing(EstimatorPair& pair, std::uint64_t) { pair.run_for(1s); }

TEST(EstimatorFaults, WithNothingWrongThereIsAGoodPoseAtEveryTick) {
  const Trials plain(do_nothing);

  EXPECT_EQ(plain.during.poses, static_cast<int>(kSeeds) * 50);
  EXPECT_EQ(plain.restarts, 0U);
  EXPECT_LT(plain.after.worst_m, 0.25);  // the range's bias of 0.05 m, four sigma, and some
  EXPECT_LT(plain.after.worst_rad, 0.03);
}

TEST(EstimatorFaults, HundredPairsWithNothingWrongAreHonest) {
  const Trials plain(do_nothing, 100);

  EXPECT_LE(plain.during.dishonest_share(), 0.01);
  EXPECT_LE(plain.after.dishonest_share(), 0.01);
}

TEST(EstimatorFaults, ANeighborThatPassesFromCameraToCameraIsKept) {
  // Each is misaligned in its own way.
  int changes = 0;
  const Trials passing([&changes](EstimatorPair& pair, std::uint64_t) {
    pair.run_for(10s);
    changes += pair.camera_changes();
  });

  EXPECT_GT(changes, static_cast<int>(kSeeds));
  EXPECT_EQ(passing.restarts, 0U);
  EXPECT_LE(passing.during.dishonest_share(), 0.01);
  EXPECT_LT(passing.during.worst_m, 0.25);
  EXPECT_LT(passing.during.worst_rad, 0.03);
}

TEST(EstimatorFaults, ATiltOfTheFutureIsForgottenInTheNextPause) {
  using namespace std::chrono;
  for (const Duration ahead : {Duration{90ms}, Duration{400ms}, Duration{hours{5} + minutes{54}}}) {
    EstimatorPair pair(1);
    pair.run_for(kWarmUp);
    ASSERT_NE(pair.latest(), nullptr);
    pair.run_for(EstimatorPair::kTick,
                 {.peer_report = [ahead](Report& report) { report.tilt.stamp += ahead; }});
    pair.run_for(3s, {.in_view = false, .peer_is_on = false});
    pair.run_for(3s);

    EXPECT_NE(pair.status().reason, NoPoseReason::kTiltUnknown);
    ASSERT_NE(pair.latest(), nullptr) << name_of(pair.status().reason);
    EXPECT_LT(pair.latest()->error.head<3>().norm(), 0.3);
  }
}

TEST(EstimatorFaults, ASampleOfTheFutureKeepsNoDeadNeighborAlive) {
  EstimatorPair pair(1);
  pair.run_for(kWarmUp);
  ASSERT_NE(pair.latest(), nullptr);
  pair.run_for(EstimatorPair::kTick,
               {.peer_report = [](Report& report) { report.imu.back().stamp += 900ms; }});
  pair.run_for(750ms, {.peer_is_on = false});

  EXPECT_EQ(pair.latest(), nullptr);
}

/// The same numbers again and again, with stamps that go on.
auto frozen() {
  return [held = std::optional<ImuSample>()](const ImuSample& sample) mutable {
    if (!held) held = sample;
    return *held;
  };
}

/// An accelerometer that reads the end of its range, 2 g.
ImuSample at_its_end(const ImuSample& sample) {
  ImuSample read = sample;
  read.accel_mps2.z() = 2.0 * kGravityMps2;
  return read;
}

/// No pose from half a second on, for this reason; as soon as the sensor speaks again, a new one.
template <class Fault>
void expect_unknown_for(NoPoseReason reason, const Fault& fault) {
  const Trials trials([&](EstimatorPair& pair, std::uint64_t seed) {
    const Conditions with = fault();
    pair.run_for(750ms, with);
    EXPECT_EQ(pair.latest(), nullptr) << seed;
    EXPECT_EQ(pair.status().reason, reason) << seed;
    pair.run_for(500ms, with);
    EXPECT_EQ(pair.latest(), nullptr) << seed;
  });

  EXPECT_GT(trials.during.poses, static_cast<int>(kSeeds) * 20);
  EXPECT_LE(trials.during.dishonest_share(), 0.01);
  EXPECT_LE(trials.slowest_return, 500ms);
  EXPECT_LE(trials.after.dishonest_share(), 0.01);
}

TEST(EstimatorFaults, AnImuThatHangsTakesThePoseAwayAndIsReported) {
  expect_unknown_for(NoPoseReason::kNoOwnImu, [] { return Conditions{.own_imu = frozen()}; });
}

TEST(EstimatorFaults, APeersImuThatHangsTakesThePoseAwayAndIsReported) {
  expect_unknown_for(NoPoseReason::kNoPeerImu, [] { return Conditions{.peer_imu = frozen()}; });
}

/// Three quarters of a second of an accelerometer that reads the end of its range: no pose, and a
/// reason.
template <bool kOwn>
void saturate(EstimatorPair& pair, std::uint64_t seed) {
  Conditions with;
  (kOwn ? with.own_imu : with.peer_imu) = at_its_end;
  pair.run_for(100ms, with);
  EXPECT_EQ(pair.latest(), nullptr) << seed;
  pair.run_for(650ms, with);
  EXPECT_EQ(pair.latest(), nullptr) << seed;
  EXPECT_EQ(pair.status().reason, kOwn ? NoPoseReason::kNoOwnImu : NoPoseReason::kNoPeerImu);
}

TEST(EstimatorFaults, ASaturatedImuTakesThePoseAwayAndIsReported) {
  EXPECT_LE(Trials(saturate<true>).slowest_return, 500ms);
  EXPECT_LE(Trials(saturate<false>).slowest_return, 500ms);
}

/// Solutions come ten times a second; they say for three quarters of a second that our gyroscope or
/// the neighbor's is false.
template <bool kOwn>
void distrust(EstimatorPair& pair, std::uint64_t seed) {
  TeamSolution solution;
  solution.faults = {
      {kOwn ? EstimatorPair::kSelf : EstimatorPair::kOther, TeamFault::Kind::kGyro, 0.5}};
  for (Duration time{}; time < 750ms; time += 100ms) {
    pair.solve(solution);
    pair.run_for(100ms);
    EXPECT_EQ(pair.latest(), nullptr) << seed;
  }
  EXPECT_EQ(pair.status().reason, kOwn ? NoPoseReason::kNoOwnImu : NoPoseReason::kNoPeerImu)
      << seed;
}

TEST(EstimatorFaults, AGyroscopeThatTheTeamFoundFalseTakesThePoseAway) {
  const Trials own(distrust<true>, 20);
  EXPECT_LE(own.slowest_return, 1s);
  EXPECT_LE(own.after.dishonest_share(), 0.02);
  const Trials others(distrust<false>, 20);
  EXPECT_LE(others.slowest_return, 1s);
  EXPECT_LE(others.after.dishonest_share(), 0.02);
}

TEST(EstimatorFaults, ANeighborThatTheTeamKnowsNoMoreHasNoPose) {
  Conditions hidden;
  hidden.in_view = false;
  EstimatorPair pair(1);
  pair.run_for(2s, hidden);
  ASSERT_EQ(pair.latest(), nullptr);
  TeamPose known{.neighbor = EstimatorPair::kOther,
                 .T_B_N = {{3.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()}};
  known.covariance.diagonal().setConstant(1e-4);
  TeamSolution solution;
  solution.stamp = pair.own_time(pair.now() - 100ms);
  known.last_sighting = solution.stamp;
  solution.poses = {known};

  pair.solve(solution);
  pair.run_for(20ms, hidden);
  EXPECT_NE(pair.latest(), nullptr);
  solution.stamp += 20ms;
  solution.poses.clear();
  pair.solve(solution);
  pair.run_for(20ms, hidden);
  EXPECT_EQ(pair.latest(), nullptr);
}

TEST(EstimatorFaults, HundredStartsAfterASaturatedImuAreHonest) {
  // A pose that starts three sigma off stays so for a while: a few of these decide the share. Our
  // tilt starts anew from a single sample in flight, as wrong as the robot then accelerates.
  EXPECT_LE(Trials(saturate<true>, 100).after.dishonest_share(), 0.02);
  EXPECT_LE(Trials(saturate<false>, 100).after.dishonest_share(), 0.02);
}

void hide(EstimatorPair& pair, std::uint64_t) { pair.run_for(2s, {.in_view = false}); }

TEST(EstimatorFaults, AfterTwoSecondsOutOfViewThePoseIsMeasuredAgainWithin200Milliseconds) {
  const Trials trials(hide);

  EXPECT_LE(trials.slowest_return, 200ms);
  EXPECT_LT(trials.during.direct, trials.during.poses / 3);  // predicted, from half a second on
  EXPECT_LT(trials.settled.worst_m, 0.25);
  EXPECT_LT(trials.settled.worst_rad, 0.03);
}

TEST(EstimatorFaults, HundredNeighborsOutOfViewArePredictedHonestly) {
  const Trials trials(hide, 100);

  EXPECT_LE(trials.during.dishonest_share(), 0.01);
  EXPECT_LE(trials.after.dishonest_share(), 0.01);
}

TEST(EstimatorFaults, ANeighborThatRebootsWithAnotherClockIsBackWithinASecond) {
  const Trials trials([](EstimatorPair& pair, std::uint64_t seed) {
    pair.run_for(1500ms, {.peer_is_on = false});
    EXPECT_EQ(pair.latest(), nullptr) << seed;
    EXPECT_EQ(pair.status().reason, NoPoseReason::kNoPeerImu) << seed;
    pair.reboot_peer(seed % 2 == 0 ? Duration{-3s} : Duration{1h});
  });

  EXPECT_LE(trials.slowest_return, 1s);
  EXPECT_LE(trials.during.dishonest_share(), 0.01);
  EXPECT_LE(trials.after.dishonest_share(), 0.01);
  EXPECT_LT(trials.settled.worst_rad, 0.03);
}

TEST(EstimatorFaults, AnOwnClockThatJumpsAheadCostsASecond) {
  const Trials trials([](EstimatorPair& pair, std::uint64_t) { pair.jump_own_clock(30s); });

  EXPECT_LE(trials.slowest_return, 1s);
  EXPECT_LE(trials.after.dishonest_share(), 0.01);
  EXPECT_LT(trials.settled.worst_m, 0.25);
}

TEST(EstimatorFaults, RangesThroughWallsAreRefusedAndDoNoHarm) {
  const Trials trials([](EstimatorPair& pair, std::uint64_t seed) {
    RandomGeometry random(seed);
    Conditions walls;
    walls.range = [&random](UwbRange& range) {
      if (random.uniform(0.0, 1.0) > 0.3) return;
      range.range_m -= std::log(random.uniform(1e-6, 1.0));  // longer by a meter, exponentially
      if (random.uniform(0.0, 1.0) < 0.5) range.first_path_dbm -= 12.0;
    };
    pair.run_for(4s, walls);
    const auto gated = pair.count(MeasurementKind::kRange, Verdict::kGated);
    EXPECT_GT(gated, 15U) << seed;  // 100 ranges, 30 of them long
    EXPECT_LT(gated, 50U) << seed;
  });

  EXPECT_EQ(trials.restarts, 0U);
  EXPECT_LE(trials.during.dishonest_share(), 0.01);
  EXPECT_LT(trials.during.worst_m, 0.25);
}

TEST(EstimatorFaults, SomeFalseRangesDoNotWithholdThePoseForEverIfNoMoreCome) {
  EstimatorPair pair(3);
  pair.run_for(kWarmUp);
  Conditions late;
  late.range = [](UwbRange& range) { range.range_m += 1.0; };
  pair.run_for(120ms, late);
  Conditions silent;
  silent.has_ranges = false;

  pair.run_for(1s, silent);
  EXPECT_EQ(pair.latest(), nullptr) << "either may be wrong";
  pair.run_for(3s, silent);

  ASSERT_NE(pair.latest(), nullptr);
  EXPECT_LT(pair.latest()->nees, 22.46);
}

TEST(EstimatorFaults, BehindAPillarMostRangesTellAndTheOthersDoNoHarm) {
  const Trials trials([](EstimatorPair& pair, std::uint64_t seed) {
    RandomGeometry random(seed);
    Conditions pillar{.in_view = false};
    pillar.range = [&random](UwbRange& range) {
      range.range_m += 0.2 - 0.2 * std::log(random.uniform(1e-6, 1.0));
      range.first_path_dbm -= 10.0 + random.normal(3.0);  // one in five is below 8 dB
    };
    pair.run_for(4s, pillar);
  });

  EXPECT_LE(trials.during.dishonest_share(), 0.01);
  EXPECT_LE(trials.after.dishonest_share(), 0.01);
  EXPECT_LT(trials.settled.worst_m, 0.25);
}

// All ranges are 0.6 m too long for 5 s out of view, and nothing else shows it.
void lengthen_ranges_out_of_view(EstimatorPair& pair, std::uint64_t) {
  Conditions detour{.in_view = false};
  detour.range = [](UwbRange& range) { range.range_m += 0.6; };
  pair.run_for(5s, detour);
  pair.run_for(1s);
}

TEST(EstimatorFaults, ADistanceThatRangesContradictOnceTheNeighborIsBackInViewIsFoundAgain) {
  EXPECT_LT(Trials(lengthen_ranges_out_of_view).settled.worst_m, 0.25);
}

// Part of the detour passes for a range bias. With 20 seeds this share varies between 0 and 5 %; it
// is 7.4 % over these hundred, and was 3.0 % before ranges lost their influence on directions.
TEST(EstimatorFaults, HundredDistancesThatRangesContradictAreSeldomDishonest) {
  EXPECT_LE(Trials(lengthen_ranges_out_of_view, 100).after.dishonest_share(), 0.10);
}

void mistake_us(EstimatorPair& pair, std::uint64_t seed) {
  const auto before = pair.count(MeasurementKind::kPeerBearing, Verdict::kGated);
  pair.run_for(500ms, {.peer_turn_rad = 0.5});
  pair.run_for(500ms);
  EXPECT_GE(pair.count(MeasurementKind::kPeerBearing, Verdict::kGated) - before, 24U) << seed;
}

TEST(EstimatorFaults, ANeighborThatTakesAnotherForUsForHalfASecondIsNotBelieved) {
  const Trials trials(mistake_us);

  EXPECT_EQ(trials.restarts, 0U);
  EXPECT_LT(trials.during.worst_rad, 0.03);
}

TEST(EstimatorFaults, HundredNeighborsThatTakeAnotherForUsLeaveThePoseHonest) {
  EXPECT_LE(Trials(mistake_us, 100).during.dishonest_share(), 0.01);
}

TEST(EstimatorFaults, ABoardThatBlinksAnothersCodeForHalfASecondDoesLittleHarm) {
  // 0.2 s pass until the decoy has the neighbor's ID.
  const Trials trials(
      [](EstimatorPair& pair, std::uint64_t) { pair.run_for(700ms, {.decoy_rad = 0.5}); });

  EXPECT_LE(trials.during.dishonest_share(), 0.01);
  EXPECT_LE(trials.after.dishonest_share(), 0.02);
  EXPECT_LT(trials.settled.worst_m, 0.25);
  EXPECT_LT(trials.settled.worst_rad, 0.03);
}

TEST(EstimatorFaults, ReadsIdsThroughALensThatIsNotCalibratedAndFusesNoDirection) {
  const auto all = [](const EstimatorPair& pair, MeasurementKind kind) {
    const auto counts = pair.status().measurements.at(static_cast<std::size_t>(kind));
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  };
  EstimatorPair pair(1, [](EstimatorSettings& settings) {
    for (CameraCalibration& camera : settings.cameras) camera.calibrated = false;
  });

  pair.run_for(kWarmUp);

  EXPECT_GT(pair.status().id_decodes, 0U);
  EXPECT_EQ(all(pair, MeasurementKind::kBearing), 0U);
  EXPECT_GT(pair.last_bearing(), Duration{}) << "for names in the picture, and the exposure";
  // The neighbor's camera is calibrated: what it sees is still of use.
  EXPECT_GT(all(pair, MeasurementKind::kPeerBearing), 0U);
}

}  // namespace
}  // namespace crepes::estimator_faults_test
