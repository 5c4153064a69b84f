#include "estimator/calibration/swarm/swarm_start.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kNearEnough_s = 0.06;

/// The entry nearest to `t`, if there is one near.
template <class Entry>
const Entry* nearest(const std::vector<Entry>& entries, Timestamp t) {
  const auto after = std::ranges::lower_bound(entries, t, {}, &Entry::stamp);
  const Entry* best = nullptr;
  const auto gap_s = [t](const Entry& entry) { return std::abs(to_seconds(entry.stamp - t)); };
  if (after != entries.end()) best = &*after;
  if (after != entries.begin() && (best == nullptr || gap_s(*(after - 1)) < gap_s(*best)))
    best = &*(after - 1);
  return best != nullptr && gap_s(*best) < kNearEnough_s ? best : nullptr;
}

/// The rotation from one stamp to the next by the gyroscope alone.
Eigen::Quaterniond gyro_rotation(std::span<const ImuSample> imu, Timestamp from, Timestamp to) {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  auto sample = std::ranges::upper_bound(imu, from, {}, &ImuSample::stamp);
  for (Timestamp last = from; sample != imu.end() && sample->stamp <= to; ++sample) {
    q = q * so3_exp(sample->gyro_radps * to_seconds(sample->stamp - last));
    last = sample->stamp;
  }
  return q.normalized();
}

std::vector<CameraKnot> reference_knots(const SwarmProblem& problem, const SwarmStart& start) {
  const std::size_t r = start.reference;
  std::vector<CameraKnot> knots(problem.knots());
  for (std::size_t k = 0; k < knots.size(); ++k) {
    Eigen::Quaterniond& q = knots[k].q_W_B;
    const Timestamp now = problem.time_of(r, k);
    if (k > 0) {
      q = knots[k - 1].q_W_B *
          gyro_rotation(problem.records()[r].imu, problem.time_of(r, k - 1), now);
    }
    if (const EstimatedUp* up = nearest(start.up, now))
      q = shortest_rotation(q * up->up_B, Eigen::Vector3d::UnitZ()) * q;
    q.normalize();
  }
  return knots;
}

std::vector<CameraKnot> other_knots(const SwarmProblem& problem, const SwarmStart& start,
                                    const std::vector<CameraKnot>& reference, std::size_t r) {
  std::vector<CameraKnot> knots(problem.knots());
  for (std::size_t k = 0; k < knots.size(); ++k) {
    CameraKnot& knot = knots[k];
    const Timestamp now = problem.time_of(r, k);
    const Eigen::Quaterniond& q_W_B = reference[k].q_W_B;
    if (const EstimatedPose* pose = nearest(start.poses[r], now)) {
      knot.q_W_B = (q_W_B * pose->T_B_N.q).normalized();
      knot.p_W = q_W_B * pose->T_B_N.p;
      knot.v_W = q_W_B * pose->v_B_N;
    } else if (k > 0) {
      knot = knots[k - 1];
      knot.q_W_B =
          (knot.q_W_B * gyro_rotation(problem.records()[r].imu, problem.time_of(r, k - 1), now))
              .normalized();
    }
  }
  return knots;
}

/// The rate about the vertical by which a robot's gyroscope exceeds its knots [rad/s].
double excess_spin(const SwarmProblem& problem, const std::vector<CameraKnot>& knots,
                   std::size_t r) {
  double sum = 0.0;
  for (std::size_t k = 1; k < knots.size(); ++k) {
    const Eigen::Quaterniond by_gyro =
        gyro_rotation(problem.records()[r].imu, problem.time_of(r, k - 1), problem.time_of(r, k));
    const Eigen::Quaterniond& before = knots[k - 1].q_W_B;
    sum += (before * so3_log((before.conjugate() * knots[k].q_W_B).conjugate() * by_gyro)).z();
  }
  return sum / to_seconds(problem.time_of(r, knots.size() - 1) - problem.time_of(r, 0));
}

/// The heading of all is free, and a bias that all gyroscopes share is nearly so: their mean is
/// the likeliest rate to turn the world back by.
void turn_back(const SwarmProblem& problem, SwarmState& state) {
  double spin = 0.0;
  for (std::size_t r = 0; r < problem.robots(); ++r)
    spin += excess_spin(problem, state.knots[r], r) / static_cast<double>(problem.robots());
  for (std::size_t r = 0; r < problem.robots(); ++r) {
    for (std::size_t k = 0; k < state.knots[r].size(); ++k) {
      const double t_s = to_seconds(problem.time_of(r, k) - problem.time_of(r, 0));
      const Eigen::Quaterniond turn = so3_exp(Eigen::Vector3d(0.0, 0.0, spin * t_s));
      CameraKnot& knot = state.knots[r][k];
      knot.q_W_B = (turn * knot.q_W_B).normalized();
      knot.p_W = turn * knot.p_W;
      knot.v_W = turn * knot.v_W;
    }
  }
}

}  // namespace

SwarmState first_state(const SwarmProblem& problem, const std::vector<RobotConstants>& guess,
                       const SwarmStart& start) {
  SwarmState state{.robots = guess,
                   .knots = {},
                   .pair_bias_m = std::vector<double>(pair_count(guess.size()), 0.0),
                   .pair_drift_m = {}};
  state.pair_drift_m.assign(problem.knots(), state.pair_bias_m);
  const std::vector<CameraKnot> reference = reference_knots(problem, start);
  for (std::size_t r = 0; r < problem.robots(); ++r) {
    state.knots.push_back(r == start.reference ? reference
                                               : other_knots(problem, start, reference, r));
  }
  turn_back(problem, state);
  return state;
}

}  // namespace crepes
