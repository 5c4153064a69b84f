#include "estimator/team/belief/robot_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "estimator/core/so3.hpp"
#include "estimator/team/belief/team_interval.hpp"

namespace crepes {
namespace {

const double kStepSeconds = to_seconds(TeamInterval::kStep);

}  // namespace

/// What moves a body from a point of the grid on, for `dt`.
struct RobotTrajectory::Step {
  std::size_t index = 0;
  double dt = 0.0;
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  ///< corrected rate and specific force
  Eigen::Vector3d f = Eigen::Vector3d::Zero();
  Eigen::Quaterniond half = Eigen::Quaterniond::Identity();  ///< half of the turn

  /// Forces are turned to the middle of the step, as in `propagated` of the pair's filter.
  [[nodiscard]] FreeMotion moved(const FreeMotion& from) const {
    const Eigen::Vector3d a = from.q_F_B * (half * f);
    return {from.p_F + dt * from.v_F + 0.5 * dt * dt * a, from.v_F + dt * a,
            (from.q_F_B * half * half).normalized()};
  }
};

RobotTrajectory::RobotTrajectory(const FreeMotion& start, ImuBias bias,
                                 const std::vector<ImuMean>& imu, double duration_s,
                                 const ProcessNoise& noise)
    : imu_(&imu), bias_(std::move(bias)), noise_(noise) {
  FreeMotionAt first;
  first.motion = start;
  first.by_bias.setZero();
  first.noise.setZero();
  grid_.reserve(imu.size() + 1);
  grid_.push_back(first);
  for (std::size_t step = 0; step < imu.size(); ++step) {
    const double rest = duration_s - static_cast<double>(step) * kStepSeconds;
    grid_.push_back(advanced(grid_.back(), rates(step, std::min(kStepSeconds, rest))));
  }
}

FreeMotionAt RobotTrajectory::at(double t_s) const {
  const Step step = step_at(t_s);
  return step.dt > 0.0 ? advanced(grid_[step.index], step) : grid_[step.index];
}

FreeMotion RobotTrajectory::motion_at(double t_s) const {
  const Step step = step_at(t_s);
  return step.moved(grid_[step.index].motion);
}

Eigen::Vector3d RobotTrajectory::velocity_F(double t_s, const Eigen::Vector3d& p_B) const {
  const Step step = step_at(t_s);
  const FreeMotion motion = step.moved(grid_[step.index].motion);
  return motion.v_F + motion.q_F_B * step.w.cross(p_B);
}

const FreeMotionAt& RobotTrajectory::nearest(double t_s) const {
  const auto last = static_cast<double>(grid_.size() - 1);
  return grid_[static_cast<std::size_t>(std::clamp(std::round(t_s / kStepSeconds), 0.0, last))];
}

RobotTrajectory::Step RobotTrajectory::step_at(double t_s) const {
  const auto last = static_cast<double>(imu_->size() - 1);
  const auto index = static_cast<std::size_t>(std::clamp(t_s / kStepSeconds, 0.0, last));
  return rates(index, t_s - static_cast<double>(index) * kStepSeconds);
}

RobotTrajectory::Step RobotTrajectory::rates(std::size_t index, double dt) const {
  const ImuMean& mean = (*imu_)[index];
  Step step{.index = index, .dt = dt};
  step.w = without_errors(mean.gyro_radps, bias_.gyro_radps, bias_.gyro_scale);
  step.f = mean.accel_mps2 - bias_.accel_mps2;
  step.half = so3_exp(0.5 * dt * step.w);
  return step;
}

FreeMotionAt RobotTrajectory::advanced(const FreeMotionAt& from, const Step& step) const {
  const ImuMean& mean = (*imu_)[step.index];
  const double dt = step.dt;
  const Eigen::Vector3d& w = step.w;
  const Eigen::Matrix3d R = from.motion.R();
  const Eigen::Matrix3d H = step.half.toRotationMatrix();
  FreeMotionAt to;
  to.t_s = from.t_s + dt;
  to.motion = step.moved(from.motion);

  const Eigen::Matrix3d v_by_theta = -dt * R * hat(H * step.f);
  const Eigen::Matrix3d a_by_w = -0.5 * dt * R * H * hat(step.f) * so3_right_jacobian(0.5 * dt * w);
  const Eigen::Matrix3d turn = (H * H).transpose();
  // The product of the derivative by the motion before, which is mostly empty, with a matrix.
  const auto carried = [&](const auto& m) {
    using Carried = std::decay_t<decltype(m)>;
    const auto v = m.template middleRows<3>(3);
    const auto theta = m.template bottomRows<3>();
    const Eigen::Matrix<double, 3, Carried::ColsAtCompileTime> dv = v_by_theta.lazyProduct(theta);
    Carried result;
    result.template topRows<3>() = m.template topRows<3>() + dt * v + 0.5 * dt * dv;
    result.template middleRows<3>(3) = v + dv;
    result.template bottomRows<3>() = turn.lazyProduct(theta);
    return result;
  };
  Eigen::Matrix<double, 9, 6> by_rates;
  by_rates << 0.5 * dt * dt * a_by_w, 0.5 * dt * dt * R * H,  //
      dt * a_by_w, dt * R * H,                                //
      dt * so3_right_jacobian(dt * w), Eigen::Matrix3d::Zero();

  to.by_bias = carried(from.by_bias);
  to.by_bias.leftCols<6>() -= by_rates;
  for (int axis = 0; axis < 3; ++axis)
    to.by_bias.middleCols<3>(6 + 3 * axis) -= w(axis) * by_rates.leftCols<3>();
  const Eigen::Matrix<double, 6, 1> variance = rate_variance(mean, mean, noise_, dt).head<6>();
  const MotionMatrix half_carried = carried(from.noise).transpose();
  const Eigen::Matrix<double, 9, 6> scaled = by_rates * variance.asDiagonal();
  to.noise = carried(half_carried);
  to.noise += scaled.lazyProduct(by_rates.transpose());
  return to;
}

}  // namespace crepes
