#include "estimator/calibration/swarm/swarm_batch.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/core/constants.hpp"
#include "tests/support/calibration_swarm.hpp"

namespace crepes::swarm_batch_test {
namespace {

const ImuNoise kSwarmNoise;

SwarmBatchResult calibrated(const simulated::SwarmFlight& flight) {
  return calibrate_swarm(flight.records, flight.guess, flight.start,
                         {.names = flight.names, .on_progress = {}});
}

bool says(const std::vector<std::string>& sentences, const std::string& words) {
  for (const std::string& sentence : sentences)
    if (sentence.find(words) != std::string::npos) return true;
  return false;
}

TEST(SwarmProblem, HasTheGradientOfItsCost) {
  const auto flight = simulated::fly(2, {.robots = 2, .duration_s = 1.5}, kSwarmNoise);
  SwarmProblem problem(flight.records, Timestamp{from_seconds(0.1)}, Timestamp{from_seconds(1.4)});
  problem.set_priors(
      {default_robot_priors(320.0, kSwarmNoise), default_robot_priors(320.0, kSwarmNoise)});
  problem.set_sigmas({0.5, 0.7}, 0.06);
  const SwarmState start = first_state(problem, flight.guess, flight.start);
  SwarmState state = start;
  state.robots[1].clock_s = 3e-4;
  state.robots[1].clock_skew = 1e-5;
  for (RobotConstants& robot : state.robots) robot.camera.shift_s = 1.7e-3;
  state.pair_bias_m[0] = 0.03;
  for (std::size_t k = 0; k < problem.knots(); ++k)
    state.pair_drift_m[k][0] = 1e-3 * static_cast<double>(k);
  TeamArrowSystem system = problem.linearize(state, start);

  const int constants = 2 * swarm_constants::kSize + 1;
  TeamArrowSystem::Step step;
  step.states.assign(problem.knots(), Eigen::VectorXd::Zero(31));
  step.constants = Eigen::VectorXd::Zero(constants);
  const auto slope = [&](double& x) {
    constexpr double h = 1e-7;
    x = h;
    const double above = problem.cost(moved(state, step), start);
    x = -h;
    const double below = problem.cost(moved(state, step), start);
    x = 0.0;
    return (above - below) / (2.0 * h);
  };
  // No time lies on a knot, where the cost has a step of the IMU's noise.
  for (int i = 0; i < constants; ++i) {
    const bool is_gauge = i == swarm_constants::kClock || i == swarm_constants::kSkew;
    if (is_gauge) continue;
    const double expected = -system.constants_gradient()(i);
    EXPECT_NEAR(slope(step.constants(i)), expected, 1e-3 * std::abs(expected) + 2.0) << i;
  }
  for (int i = 0; i < 31; ++i) {
    const double expected = -system.gradient(20)(i);
    EXPECT_NEAR(slope(step.states[20](i)), expected, 1e-3 * std::abs(expected) + 2.0) << i;
  }
}

TEST(SwarmProblem, PutsKnotsOfAllRobotsAtTheSameTimesWhereSamplesAreMissing) {
  auto flight = simulated::fly(2, {.robots = 2, .duration_s = 1.5}, kSwarmNoise);
  auto& imu = flight.records[1].imu;
  imu.erase(imu.begin() + 50, imu.begin() + 54);
  const SwarmProblem problem(flight.records, Timestamp{from_seconds(0.1)},
                             Timestamp{from_seconds(1.4)});

  for (std::size_t k = 0; k < problem.knots(); ++k)
    EXPECT_LT(std::abs(to_seconds(problem.time_of(0, k) - problem.time_of(1, k))), 0.031) << k;
}

TEST(SwarmBatch, FindsCamerasLeversAndDelaysOfAllRobots) {
  const auto flight = simulated::fly(1, {}, kSwarmNoise);
  const SwarmBatchResult found = calibrated(flight);

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  ASSERT_EQ(found.robots.size(), 3U);
  double square_before = 0.0;
  double square = 0.0;
  for (std::size_t r = 0; r < 3; ++r) {
    const CalibratedRobot& robot = found.robots[r];
    const RobotPriors before = difference(robot.before, flight.truth[r]);
    const RobotPriors after = difference(robot.after, flight.truth[r]);
    EXPECT_LT(after.segment<3>(swarm_constants::kRotation).norm(), radians(0.3)) << r;
    EXPECT_LT(std::abs(after(swarm_constants::kShift)), 3e-4) << r;
    EXPECT_NEAR(robot.spot_sigma_px, 0.15, 0.02) << r;
    square_before += before.segment<3>(swarm_constants::kRing).squaredNorm();
    square += after.segment<3>(swarm_constants::kRing).squaredNorm();
  }
  EXPECT_LT(square, 0.1 * square_before);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i + 1; j < 3; ++j)
      EXPECT_NEAR(found.robots[i].after.range_delay_m + found.robots[j].after.range_delay_m,
                  flight.truth[i].range_delay_m + flight.truth[j].range_delay_m,
                  4.0 * pair_delay_sigma(found, i, j));
}

/// By degree of freedom, of the cameras' rotations, rings and antennas.
double nees_of(const SwarmBatchResult& found, const std::vector<RobotConstants>& truth) {
  double sum = 0.0;
  for (std::size_t r = 0; r < truth.size(); ++r) {
    const RobotPriors e = difference(found.robots[r].after, truth[r]);
    for (const int begin :
         {swarm_constants::kRotation, swarm_constants::kRing, swarm_constants::kAntenna}) {
      const auto at = static_cast<Eigen::Index>(r) * swarm_constants::kSize + begin;
      const Eigen::Matrix3d P = found.covariance.block<3, 3>(at, at);
      sum += e.segment<3>(begin).dot(P.inverse() * e.segment<3>(begin));
    }
  }
  return sum / (9.0 * static_cast<double>(truth.size()));
}

// Four robots have six pairs and four delays. Taken for white noise, what the delays do not explain
// puts antennas and rings many sigmas off.
TEST(SwarmBatch, IsHonestWherePairsHaveBiasesOfTheirOwn) {
  auto flight = simulated::fly(5,
                               {.robots = 4,
                                .duration_s = 12.0,
                                .camera_rate_hz = 25.0,
                                .range_rate_hz = 50.0,
                                .pair_bias_m = 0.05,
                                .pair_drift_m = 0.014},
                               kSwarmNoise);
  const SwarmBatchResult found = calibrated(flight);
  for (RobotRecord& record : flight.records)
    record.range_noise.bias_sigma_m = record.range_noise.bias_drift_m = 0.0;
  const SwarmBatchResult without = calibrated(flight);

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  // 36 degrees of freedom: 99.9 % lie below 1.9.
  EXPECT_LT(nees_of(found, flight.truth), 1.9);
  EXPECT_GT(nees_of(without, flight.truth), 3.0);
}

TEST(SwarmBatch, SaysWhatTwoRobotsCannotTellApart) {
  const auto flight = simulated::fly(3, {.robots = 2, .duration_s = 15.0}, kSwarmNoise);
  const SwarmBatchResult found = calibrated(flight);

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  EXPECT_TRUE(says(found.warnings, "does not determine all"));
  // Of two modules only the sum shows.
  EXPECT_LT(pair_delay_sigma(found, 0, 1), 0.5 * found.robots[0].sigma(swarm_constants::kDelay));
}

void drop_poses_before(double t_s, simulated::SwarmFlight& flight) {
  for (std::vector<EstimatedPose>& poses : flight.start.poses)
    std::erase_if(poses,
                  [&](const auto& pose) { return pose.stamp < Timestamp{from_seconds(t_s)}; });
}

// A minute is used at most, and only from when everybody has been placed.
TEST(SwarmBatch, CountsNoOutliersAtTimesThatItDoesNotUse) {
  auto flight = simulated::fly(3, {.robots = 2, .duration_s = 27.0}, kSwarmNoise);
  drop_poses_before(12.0, flight);
  const SwarmBatchResult found = calibrated(flight);

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  EXPECT_NEAR(found.seconds, 15.0, 0.1);
  for (const CalibratedRobot& robot : found.robots) EXPECT_LT(robot.outliers, 0.05);
  EXPECT_LT(found.range_outliers, 0.05);
}

TEST(SwarmBatch, RefusesARobotThatNobodySees) {
  auto flight = simulated::fly(4, {.duration_s = 12.0}, kSwarmNoise);
  for (RobotRecord& record : flight.records)
    std::erase_if(record.sightings, [](const BoardSighting& s) { return s.board == 2; });

  EXPECT_TRUE(says(calibrated(flight).refusals, "r3 is seen by others 0 times"));
}

TEST(SwarmBatch, RefusesARecordingThatIsTooShort) {
  EXPECT_TRUE(says(calibrated(simulated::fly(4, {.duration_s = 8.0}, kSwarmNoise)).refusals,
                   "record half a minute"));
}

TEST(SwarmBatch, RefusesAGapInInertialSamples) {
  auto flight = simulated::fly(4, {.duration_s = 12.0}, kSwarmNoise);
  auto& imu = flight.records[1].imu;
  imu.erase(imu.begin() + 500, imu.begin() + 520);

  EXPECT_TRUE(says(calibrated(flight).refusals, "r2 has a gap"));
}

TEST(SwarmBatch, AGapInInertialSamplesAtATimeThatItDoesNotUseDoesNoHarm) {
  auto flight = simulated::fly(4, {.robots = 2, .duration_s = 17.0}, kSwarmNoise);
  auto& imu = flight.records[1].imu;
  imu.erase(imu.begin() + 300, imu.begin() + 320);
  drop_poses_before(6.0, flight);

  EXPECT_FALSE(says(calibrated(flight).refusals, "has a gap"));
}

TEST(SwarmBatch, CountsNoSightingsAtTimesThatItDoesNotUse) {
  auto flight = simulated::fly(4, {.robots = 2, .duration_s = 27.0}, kSwarmNoise);
  drop_poses_before(12.0, flight);
  std::erase_if(flight.records[0].sightings, [](const BoardSighting& sighting) {
    return sighting.stamp > Timestamp{from_seconds(12.0)};
  });

  EXPECT_TRUE(says(calibrated(flight).refusals, "r1 sees others 0 times"));
}

TEST(SwarmBatch, RefusesOneRobotAlone) {
  auto flight = simulated::fly(4, {.duration_s = 2.0}, kSwarmNoise);
  flight.records.resize(1);

  EXPECT_TRUE(says(calibrated(flight).refusals, "one robot alone"));
}

TEST(SwarmBatch, NamesARobotWithoutAPoseToStartFrom) {
  auto flight = simulated::fly(4, {.duration_s = 12.0}, kSwarmNoise);
  flight.start.poses[1].clear();

  EXPECT_TRUE(says(calibrated(flight).refusals, "no pose of r2 by r1"));
}

}  // namespace
}  // namespace crepes::swarm_batch_test
