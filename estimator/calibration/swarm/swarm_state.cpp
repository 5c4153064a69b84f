#include "estimator/calibration/swarm/swarm_state.hpp"

#include <algorithm>

#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

namespace robot_at = swarm_constants;

void move_constants(RobotConstants& robot, const Eigen::Ref<const Eigen::VectorXd>& d) {
  constexpr double kMostDistortion = 0.95;
  CameraConstants& c = robot.camera;
  c.lens += d.segment<6>(robot_at::kLens);
  c.lens[0] = std::clamp(c.lens[0], -kMostDistortion, kMostDistortion);
  c.lens[1] = std::clamp(c.lens[1], 1.0 - kMostDistortion, kMostDistortion);
  c.q_C_B = (c.q_C_B * so3_exp(d.segment<3>(robot_at::kRotation))).normalized();
  c.p_B_C += d.segment<3>(robot_at::kPosition);
  c.shift_s += d(robot_at::kShift);
  int index = robot_at::kGyroMatrix;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.M_gyro(i, j) += d(index++);
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) c.M_accel(i, j) += d(index++);
  robot.p_B_M += d.segment<3>(robot_at::kRing);
  robot.p_B_U += d.segment<3>(robot_at::kAntenna);
  robot.range_delay_m += d(robot_at::kDelay);
  robot.clock_s += d(robot_at::kClock);
  robot.clock_skew += d(robot_at::kSkew);
}

}  // namespace

RobotPriors default_robot_priors(double focal_px, const ImuNoise& noise) {
  constexpr double kFocalShare = 0.02;
  RobotPriors priors;
  priors.segment<6>(robot_at::kLens) << 0.03, 0.02, kFocalShare * focal_px, kFocalShare * focal_px,
      5.0, 5.0;
  priors.segment<3>(robot_at::kRotation).setConstant(0.1);
  priors.segment<3>(robot_at::kPosition).setConstant(0.03);
  priors(robot_at::kShift) = 0.01;
  priors.segment<9>(robot_at::kGyroMatrix).setConstant(noise.gyroscope_scale_sigma);
  priors.segment<6>(robot_at::kAccelMatrix).setConstant(noise.accelerometer_scale_sigma);
  priors.segment<3>(robot_at::kRing).setConstant(0.03);
  priors.segment<3>(robot_at::kAntenna).setConstant(0.03);
  priors(robot_at::kDelay) = 0.2;
  priors(robot_at::kClock) = 1e-3;
  priors(robot_at::kSkew) = 1e-5;
  return priors;
}

RobotPriors difference(const RobotConstants& from, const RobotConstants& to) {
  RobotPriors d;
  d.segment<6>(robot_at::kLens) = to.camera.lens - from.camera.lens;
  d.segment<3>(robot_at::kRotation) = so3_log(from.camera.q_C_B.conjugate() * to.camera.q_C_B);
  d.segment<3>(robot_at::kPosition) = to.camera.p_B_C - from.camera.p_B_C;
  d(robot_at::kShift) = to.camera.shift_s - from.camera.shift_s;
  int index = robot_at::kGyroMatrix;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) d(index++) = to.camera.M_gyro(i, j) - from.camera.M_gyro(i, j);
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) d(index++) = to.camera.M_accel(i, j) - from.camera.M_accel(i, j);
  d.segment<3>(robot_at::kRing) = to.p_B_M - from.p_B_M;
  d.segment<3>(robot_at::kAntenna) = to.p_B_U - from.p_B_U;
  d(robot_at::kDelay) = to.range_delay_m - from.range_delay_m;
  d(robot_at::kClock) = to.clock_s - from.clock_s;
  d(robot_at::kSkew) = to.clock_skew - from.clock_skew;
  return d;
}

SwarmState moved(const SwarmState& state, const TeamArrowSystem::Step& step) {
  SwarmState next = state;
  for (std::size_t r = 0; r < next.robots.size(); ++r) {
    move_constants(next.robots[r], step.constants.segment(constants_index(r), robot_at::kSize));
    for (std::size_t k = 0; k < next.knots[r].size(); ++k) {
      CameraKnot& knot = next.knots[r][k];
      const ArrowSystem::StateVector s = step.states[k].segment<ArrowSystem::kState>(body_index(r));
      knot.q_W_B = (knot.q_W_B * so3_exp(s.head<3>())).normalized();
      knot.v_W += s.segment<3>(3);
      knot.p_W += s.segment<3>(6);
      knot.gyro_bias += s.segment<3>(9);
      knot.accel_bias += s.segment<3>(12);
    }
  }
  const Eigen::Index pairs_at = constants_index(next.robots.size());
  for (std::size_t i = 0; i < next.pair_bias_m.size(); ++i)
    next.pair_bias_m[i] += step.constants(pairs_at + static_cast<Eigen::Index>(i));
  const Eigen::Index drift_at = body_index(next.robots.size());
  for (std::size_t k = 0; k < next.pair_drift_m.size(); ++k) {
    for (std::size_t i = 0; i < next.pair_drift_m[k].size(); ++i)
      next.pair_drift_m[k][i] += step.states[k](drift_at + static_cast<Eigen::Index>(i));
  }
  return next;
}

}  // namespace crepes
