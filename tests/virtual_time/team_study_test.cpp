/// The tools by which the estimate of a team is judged: its bound, its scenarios, its liars.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "estimator/core/constants.hpp"
#include "tests/study/load_swarm.hpp"
#include "tests/study/simulated_swarm.hpp"
#include "tests/study/team_trial.hpp"
#include "tests/support/places.hpp"

namespace crepes::study::team_study_test {
namespace {

namespace fs = std::filesystem;

constexpr double kAfter = 5.0;  // s

const Scenario& scenario(std::string_view name) {
  return *std::find_if(kScenarios.begin(), kScenarios.end(),
                       [name](const Scenario& s) { return s.name == name; });
}

TEST(TeamBound, OfTwoRobotsIsThatOfAPair) {
  const Swarm swarm = simulate_swarm(scenario("manual"), 1, 10.0);

  const TeamBound team = team_bound(swarm, {}, kAfter);
  const TeamBound scaled = team_bound(swarm, kScaledPriors, kAfter);

  // Steps and updates of the pair's are finer.
  for (const auto& [observer, neighbor] : pairs_of(swarm)) {
    const PairBound pair = pair_bound(swarm, observer, neighbor, {}, kAfter);
    const PairBound& one = team.at({observer, neighbor});
    EXPECT_NEAR(one.position_rms_m / pair.position_rms_m, 1.0, 0.01);
    EXPECT_NEAR(one.rotation_rms_rad / pair.rotation_rms_rad, 1.0, 0.01);
    const PairBound scaled_pair = pair_bound(swarm, observer, neighbor, kScaledPriors, kAfter);
    const PairBound& scaled_one = scaled.at({observer, neighbor});
    EXPECT_NEAR(scaled_one.position_rms_m / scaled_pair.position_rms_m, 1.0, 0.01);
    EXPECT_NEAR(scaled_one.rotation_rms_rad / scaled_pair.rotation_rms_rad, 1.0, 0.01);
  }
}

TEST(TeamBound, IsBelowThatOfEveryPairAndTheSameFromEveryReference) {
  Swarm swarm = simulate_swarm(scenario("four"), 1, 8.0);

  const TeamBound team = team_bound(swarm, {}, kAfter);
  std::rotate(swarm.dataset.robots.begin(), swarm.dataset.robots.begin() + 2,
              swarm.dataset.robots.end());
  const TeamBound from_another = team_bound(swarm, {}, kAfter);

  for (const auto& [pair, bound] : team) {
    EXPECT_NEAR(from_another.at(pair).position_rms_m / bound.position_rms_m, 1.0, 1e-3);
    EXPECT_NEAR(from_another.at(pair).rotation_rms_rad / bound.rotation_rms_rad, 1.0, 1e-3);
    EXPECT_LT(bound.position_rms_m,
              pair_bound(swarm, pair.first, pair.second, {}, kAfter).position_rms_m);
    // The angle of a rotation is that of its inverse.
    EXPECT_NEAR(team.at({pair.second, pair.first}).rotation_rms_rad / bound.rotation_rms_rad, 1.0,
                1e-9);
  }
}

struct Published {
  const char* set;
  int observers;  ///< the first of them
  double position_m;
  double rotation_deg;
};
void PrintTo(const Published& published, std::ostream* out) { *out << published.set; }

/// Bounds of the independent recordings that came with them, computed by others.
class PublishedTeamBound : public testing::TestWithParam<Published> {};

TEST_P(PublishedTeamBound, IsReproduced) {
  const fs::path dir = fs::path(source_dir()) / "../shared/datasets" / GetParam().set;
  if (!fs::exists(dir)) GTEST_SKIP() << "no recording at " << dir;
  const Swarm swarm = load_swarm_with_truth(dir).value();

  TeamBound bound = team_bound(swarm, {}, kAfter);
  std::erase_if(bound,
                [](const auto& entry) { return entry.first.first.value > GetParam().observers; });
  const PairBound all = pooled(bound);

  // They know their noise; we read it off the recordings.
  EXPECT_NEAR(all.position_rms_m / GetParam().position_m, 1.0, 0.12);
  EXPECT_NEAR(all.rotation_rms_rad / radians(GetParam().rotation_deg), 1.0, 0.12);
}
INSTANTIATE_TEST_SUITE_P(Datasets, PublishedTeamBound,
                         testing::Values(Published{"four", 1, 0.015, 0.16},
                                         Published{"occluded", 1, 0.011, 0.15},
                                         Published{"cluttered", 2, 0.0099, 0.135},
                                         Published{"fence", 2, 0.0132, 0.142}));

TEST(LinkTrackErrors, AreDistributedAsThoseOfRealModules) {
  constexpr int kPairs = 300;
  constexpr int kTimes = 200;
  double beyond_39 = 0.0;
  double beyond_73 = 0.0;
  double within_second = 0.0;
  for (std::uint16_t pair = 0; pair < kPairs; ++pair) {
    const RobotId other{static_cast<std::uint16_t>(2 + pair)};
    for (int i = 0; i < kTimes; ++i) {
      const double t = 3.0 * i + 0.2;
      const double error = link_track_error_m(1, RobotId{1}, other, t);
      if (std::abs(error) > 0.39) beyond_39 += 1.0 / (kPairs * kTimes);
      if (std::abs(error) > 0.73) beyond_73 += 1.0 / (kPairs * kTimes);
      const double change = link_track_error_m(1, RobotId{1}, other, t + 0.5) - error;
      within_second += 0.5 * change * change / (kPairs * kTimes);
    }
  }

  EXPECT_NEAR(beyond_39, 0.05, 0.005);
  EXPECT_NEAR(beyond_73, 0.01, 0.002);
  EXPECT_NEAR(std::sqrt(within_second), 0.086, 0.002);
}

TEST(ThinRanges, AreHalfAReadingASecondOfEachPair) {
  const Swarm swarm = simulate_swarm(scenario("thin-ranges"), 1, 24.0);

  const auto count = [&](RobotId from, RobotId to) {
    const auto& ranges = recording_of(swarm.dataset, from).ranges;
    return std::count_if(ranges.begin(), ranges.end(),
                         [to](const UwbRange& range) { return range.neighbor == to; });
  };
  for (const auto& [a, b] : pairs_of(swarm)) EXPECT_EQ(count(a, b) + count(b, a), 12);
}

/// Share of the frames in which `from` sees `to`, and of those after which that changes.
std::pair<double, double> view_of(const Swarm& swarm, RobotId from, RobotId to) {
  const auto seen = true_sightings(swarm, from, to).sightings;
  const double frames =
      static_cast<double>(recording_of(swarm.dataset, from).cameras.front().spots.size());
  double gaps = 0.0;
  for (std::size_t i = 1; i < seen.size(); ++i)
    if (seen[i].true_s - seen[i - 1].true_s > 0.1) gaps += 1.0;
  return {static_cast<double>(seen.size()) / frames, gaps};
}

TEST(Fence, ShowsNeighborsBehindItInGlimpses) {
  const Swarm open = simulate_swarm(scenario("four"), 1, 20.0);
  const Swarm fenced = simulate_swarm(scenario("fence"), 1, 20.0);

  const auto [open_share, open_gaps] = view_of(open, RobotId{1}, RobotId{3});
  const auto [share, gaps] = view_of(fenced, RobotId{1}, RobotId{3});

  EXPECT_LT(share, 0.75 * open_share);
  EXPECT_GT(share, 0.1 * open_share);
  EXPECT_GT(gaps, open_gaps + 5.0);
  // Radio passes.
  EXPECT_EQ(true_sightings(fenced, RobotId{1}, RobotId{3}).ranges.size(),
            true_sightings(open, RobotId{1}, RobotId{3}).ranges.size());
}

TEST(Clutter, HidesPairsAndMakesTheirRangesLate) {
  const Swarm open = simulate_swarm(scenario("four"), 1, 20.0);
  const Swarm cluttered = simulate_swarm(scenario("cluttered"), 1, 20.0);

  const OneWay before = true_sightings(open, RobotId{1}, RobotId{3});
  const OneWay after = true_sightings(cluttered, RobotId{1}, RobotId{3});

  EXPECT_LT(after.sightings.size(), before.sightings.size());
  EXPECT_LT(after.ranges.size(), before.ranges.size());
}

TEST(Blackout, LeavesFramesWithoutSpots) {
  Scenario dark = scenario("blackout");
  dark.dark = {.from_s = 2.0, .to_s = 4.0};
  const Swarm swarm = simulate_swarm(dark, 1, 6.0);

  const RobotRecording& robot = recording_of(swarm.dataset, RobotId{1});
  std::size_t dark_frames = 0;
  std::size_t lit = 0;
  for (const SpotFrame& frame : robot.cameras.front().spots) {
    const double t = robot.robot.clock.true_s(frame.stamp);
    const bool is_dark = t > 2.001 && t < 3.999;
    EXPECT_TRUE(!is_dark || frame.spots.empty());
    dark_frames += is_dark ? 1 : 0;
    lit += is_dark || frame.spots.empty() ? 0 : 1;
  }
  EXPECT_NEAR(static_cast<double>(dark_frames), 400.0, 2.0);
  EXPECT_GT(lit, 300U);
}

TEST(Liars, ChangeWhatTheyRecordOrSend) {
  const Swarm honest = simulate_swarm(scenario("four"), 1, 2.0);
  const RobotId liar{4};
  const auto corrupted = [&](Lie lie) {
    SwarmDataset dataset = honest.dataset;
    corrupt(lie, liar, dataset);
    return dataset;
  };
  const RobotRecording& was = recording_of(honest.dataset, liar);
  const auto now = [&](Lie lie) { return recording_of(corrupted(lie), liar); };

  EXPECT_NEAR(now(Lie::kRanges).ranges[0].range_m - was.ranges[0].range_m, 1.0, 1e-12);
  EXPECT_EQ(now(Lie::kClock).imu[0].stamp - was.imu[0].stamp, std::chrono::milliseconds(20));
  const auto& camera = was.config.cameras[0].calibration.T_cam_imu;
  EXPECT_NEAR(
      now(Lie::kCamera5).config.cameras[0].calibration.T_cam_imu.q.angularDistance(camera.q),
      radians(5.0), 1e-9);
  const SwarmDataset delayed = corrupted(Lie::kAntennaDelay);
  const auto& others = recording_of(delayed, RobotId{1}).ranges;
  const auto& true_ones = recording_of(honest.dataset, RobotId{1}).ranges;
  for (std::size_t i = 0; i < others.size(); ++i) {
    EXPECT_NEAR(others[i].range_m - true_ones[i].range_m, others[i].neighbor == liar ? 1.0 : 0.0,
                1e-12);
  }
  const auto neighbors = [](const RobotRecording& recording) {
    std::set<int> ids;
    for (const UwbRange& range : recording.ranges) ids.insert(range.neighbor.value);
    return ids;
  };
  EXPECT_EQ(neighbors(was), (std::set{1, 2, 3}));
  EXPECT_EQ(neighbors(now(Lie::kModules)), (std::set{2, 3, 4})) << "its own id is the other's";
  const double up_mps2 = was.imu[0].accel_mps2.z();
  EXPECT_NEAR(now(Lie::kUpsideDown).imu[0].accel_mps2.z(), -up_mps2, 1e-9);
  EXPECT_NEAR(now(Lie::kOnItsSide).imu[0].accel_mps2.y(), -up_mps2, 1e-9);
  Report report;
  report.sender = liar;
  report.estimates.resize(1);
  report.estimates[0].neighbor = RobotId{1};
  corrupted_reports(Lie::kEstimates, liar)(report);
  EXPECT_NEAR(report.estimates[0].T_B_N.pose.p.norm(), 2.0, 1e-12);
  EXPECT_NEAR(report.estimates[0].T_B_N.covariance(3, 3), 1e-6, 1e-15);
}

/// The full study is a command; this is what a few seconds can show of it.
TEST(TeamStudy, ScoresATeamAgainstItsBound) {
  const Swarm swarm = simulate_swarm(scenario("four"), 1, 6.0);
  TeamTrialOptions options;
  options.after_s = 3.0;

  const auto trial = run_team_trial(swarm, options);

  ASSERT_TRUE(trial) << trial.error().message;
  SCOPED_TRACE(table_of(std::vector{*trial}));
  EXPECT_GT(trial->reached.position_rmse_m / trial->bound.position_rms_m, 0.3);
  EXPECT_LT(trial->reached.position_rmse_m / trial->bound.position_rms_m, 10.0);
  EXPECT_NEAR(static_cast<double>(trial->reached.gross_errors.all.poses), 12.0 * 150.0, 100.0);
}

TEST(TeamStudy, PosesFromPicturesAreThoseOfAnyRing) {
  Scenario pictured = scenario("manual");
  TeamTrialOptions options;
  options.after_s = 3.0;
  std::vector<double> errors_m;
  for (const int leds : {6, 8}) {
    pictured.pictured = LedBoard{.leds = leds};
    const auto trial = run_team_trial(simulate_swarm(pictured, 1, 8.0), options);
    ASSERT_TRUE(trial) << trial.error().message;
    SCOPED_TRACE(table_of(std::vector{*trial}));
    EXPECT_GT(trial->reached.worst_availability, 0.95);
    EXPECT_EQ(trial->reached.gross_errors.all.share(), 0.0);
    errors_m.push_back(trial->reached.position_rmse_m);
  }
  EXPECT_LT(errors_m[0], 0.06);
  EXPECT_NEAR(errors_m[1] / errors_m[0], 1.0, 0.1);
}

// Floors mirror for seconds, so that robots are seen twice or only their images are.
TEST(TeamStudy, MirrorImagesCostATeamNoPoses) {
  const Swarm swarm = simulate_swarm(scenario("interference"), 5, 14.0);

  const auto trial = run_team_trial(swarm, {});

  ASSERT_TRUE(trial) << trial.error().message;
  SCOPED_TRACE(table_of(std::vector{*trial}));
  EXPECT_GT(trial->reached.worst_availability, 0.99);
  EXPECT_EQ(trial->reached.gross_errors.all.share(), 0.0);
  EXPECT_LT(trial->reached.position_rmse_m / trial->bound.position_rms_m, 2.5);
}

// A robot that broadcasts wrong estimates at a sigma of 1 mm moves the others through the pose
// graph, and not through the team's filter.
TEST(TeamStudy, ComparesTheHonestWithAndWithoutALiar) {
  const Swarm swarm = simulate_swarm(scenario("four"), 1, 6.0);
  TeamTrialOptions options;
  options.after_s = 3.0;
  for (const TeamMethod method : {TeamMethod::kPoseGraph, TeamMethod::kTeamFilter}) {
    options.method = method;
    const auto trial = run_liar_trial(swarm, kLiars.front(), options);
    ASSERT_TRUE(trial) << trial.error().message;
    SCOPED_TRACE(table_of(std::vector{*trial}));
    EXPECT_NEAR(static_cast<double>(trial->without.gross_errors.all.poses), 6.0 * 150.0, 60.0);
    EXPECT_NEAR(static_cast<double>(trial->alone.gross_errors.all.poses), 6.0 * 150.0, 60.0);
    const double ratio = trial->with.position_rmse_m / trial->without.position_rmse_m;
    if (method == TeamMethod::kPoseGraph) {
      EXPECT_GT(ratio, 2.0);
    } else {
      EXPECT_LT(ratio, 1.2);
      EXPECT_EQ(trial->with.gross_errors.all.share(), 0.0);
    }
  }
}

}  // namespace
}  // namespace crepes::study::team_study_test
