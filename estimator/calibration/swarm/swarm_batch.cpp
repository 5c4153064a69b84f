#include "estimator/calibration/swarm/swarm_batch.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "estimator/calibration/swarm/swarm_refusal.hpp"
#include "estimator/calibration/swarm/swarm_solver.hpp"

namespace crepes {
namespace {

constexpr Duration kLeastPeriod = std::chrono::milliseconds(18);
constexpr Duration kMostUsed = std::chrono::seconds(60);

/// From when everybody has been placed, to when the first recording ends, or a minute later.
struct Window {
  Timestamp from = Timestamp::min();
  Timestamp to = Timestamp::max();
};

Window window_of(const std::vector<RobotRecord>& records, const SwarmStart& start) {
  Window window;
  for (std::size_t r = 0; r < records.size(); ++r) {
    window.from = std::max(window.from, records[r].imu.front().stamp);
    window.to = std::min(window.to, records[r].imu.back().stamp);
    if (r == start.reference) continue;
    window.from = std::max(window.from, start.poses[r].front().stamp);
  }
  window.to = std::min(window.to, window.from + kMostUsed);
  return window;
}

/// What was read at other times is compared with nothing, and must not count as outliers.
void drop_outside(const Window& window, RobotRecord& record) {
  const auto is_outside = [&window](const auto& reading) {
    return reading.stamp < window.from || reading.stamp > window.to;
  };
  std::erase_if(record.sightings, is_outside);
  std::erase_if(record.ranges, is_outside);
}

/// Fifty pictures a second say nearly what all say: between them the IMU's noise counts for more
/// than the spots'.
void thin_pictures(std::vector<BoardSighting>& sightings) {
  Timestamp kept = Timestamp::min();
  std::erase_if(sightings, [&kept](const BoardSighting& sighting) {
    const bool is_new = kept == Timestamp::min() || sighting.stamp >= kept + kLeastPeriod;
    if (is_new) kept = sighting.stamp;
    return sighting.stamp != kept;
  });
}

double sigma_of_spots(const std::vector<SightingResidual>& residuals) {
  std::vector<double> squares;
  for (const SightingResidual& residual : residuals)
    if (residual.is_valid) squares.push_back(0.5 * residual.uv.squaredNorm());
  if (squares.empty()) return 0.0;
  // The better 90 %, so that a handful of wrong IDs is not the whole number.
  const auto kept = static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(squares.size()));
  std::ranges::nth_element(squares, squares.begin() + kept);
  double sum = 0.0;
  for (auto square = squares.begin(); square != squares.begin() + kept; ++square) sum += *square;
  return std::sqrt(sum / std::max(1.0, static_cast<double>(kept)));
}

void describe_robot(const SwarmSolution& solution, std::size_t r, CalibratedRobot& robot) {
  robot.after = solution.state.robots[r];
  if (solution.covariance.size() > 0) {
    const auto begin = static_cast<Eigen::Index>(r) * swarm_constants::kSize;
    robot.sigma = solution.covariance.diagonal()
                      .segment<swarm_constants::kSize>(begin)
                      .cwiseMax(0.0)
                      .cwiseSqrt();
  }
  const std::vector<CameraKnot>& knots = solution.state.knots[r];
  for (const CameraKnot& knot : knots) {
    robot.gyro_bias += knot.gyro_bias / static_cast<double>(knots.size());
    robot.accel_bias += knot.accel_bias / static_cast<double>(knots.size());
  }
  robot.spot_sigma_px = solution.sigma_px[r];
  robot.outliers = solution.outliers[r];
}

}  // namespace

double pair_delay_sigma(const SwarmBatchResult& result, std::size_t a, std::size_t b) {
  const auto delay_of = [](std::size_t r) {
    return static_cast<Eigen::Index>(r) * swarm_constants::kSize + swarm_constants::kDelay;
  };
  const Eigen::MatrixXd& P = result.covariance;
  const auto i = delay_of(a);
  const auto j = delay_of(b);
  return std::sqrt(std::max(0.0, P(i, i) + P(j, j) + 2.0 * P(i, j)));
}

double remaining_range_bias(const SwarmBatchResult& result, std::size_t robot) {
  constexpr double kLeast_m = 0.01;  // what directions of arrival change
  const std::size_t count = result.robots.size();
  double worst = kLeast_m;
  for (std::size_t other = 0; other < count; ++other) {
    if (other == robot) continue;
    const std::size_t pair = pair_index(robot, other, count);
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(result.covariance.rows());
    for (const std::size_t r : {robot, other})
      sum(static_cast<Eigen::Index>(r) * swarm_constants::kSize + swarm_constants::kDelay) = 1.0;
    sum(static_cast<Eigen::Index>(count) * swarm_constants::kSize +
        static_cast<Eigen::Index>(pair)) = 1.0;
    const double variance = std::max(0.0, sum.dot(result.covariance * sum));
    worst = std::max(worst, std::sqrt(std::pow(result.pair_bias_m[pair], 2) + variance));
  }
  return worst;
}

SwarmBatchResult calibrate_swarm(std::vector<RobotRecord> records,
                                 const std::vector<RobotConstants>& guess, const SwarmStart& start,
                                 const SwarmBatchSettings& settings) {
  SwarmBatchResult result;
  result.refusals = refusals_before_fit(records, start, settings.names);
  if (!result.refusals.empty()) return result;
  const Window window = window_of(records, start);
  result.seconds = to_seconds(window.to - window.from);
  for (RobotRecord& record : records) drop_outside(window, record);
  result.refusals = refusals_of_window(records, window.from, window.to, settings.names);
  if (!result.refusals.empty()) return result;

  for (RobotRecord& record : records) thin_pictures(record.sightings);
  SwarmProblem problem(std::move(records), window.from, window.to);
  std::vector<RobotPriors> priors;
  for (const RobotConstants& robot : guess) {
    priors.push_back(
        default_robot_priors(robot.camera.lens[2], problem.records()[priors.size()].noise));
    CalibratedRobot& calibration = result.robots.emplace_back();
    calibration.before = robot;
    calibration.prior_sigma = priors.back();
  }
  problem.set_priors(priors);
  const SwarmState first = first_state(problem, guess, start);
  const SwarmResiduals before = problem.residuals(first);
  const SwarmSolution solution = solve_swarm(problem, first, settings.on_progress);
  for (std::size_t r = 0; r < guess.size(); ++r) {
    result.robots[r].spot_before_px = sigma_of_spots(before.sightings[r]);
    result.robots[r].sightings = problem.records()[r].sightings.size();
    describe_robot(solution, r, result.robots[r]);
  }
  result.covariance = solution.covariance;
  result.pair_bias_m = solution.state.pair_bias_m;
  result.range_sigma_m = solution.sigma_m;
  result.range_outliers = solution.range_outliers;
  judge_swarm(solution, settings.names, result);
  return result;
}

}  // namespace crepes
