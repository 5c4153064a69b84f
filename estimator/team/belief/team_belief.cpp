#include "estimator/team/belief/team_belief.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/belief/frame_change.hpp"

namespace crepes {
namespace {

constexpr int kMotion = FreeMotionAt::kMotion;
constexpr int kBias = FreeMotionAt::kBias;
// The share of a pair's range-bias variance that its two modules' antenna delays explain. A delay
// is the same in all pairs of a module. The rest belongs to the pair alone, and drifts.
constexpr double kShareOfModules = 0.8;
// An accelerometer's scale errors act as a bias that changes while the robot turns. This is its
// correlation time.
constexpr double kTurnMemory = 1.0;  // s
// Errors of the clock offsets that the mesh estimates.
constexpr double kClockSigma = 3e-3;  // s
constexpr double kClockWalk = 1e-4;   // s/sqrt(s)

/// Mean over an interval [rad/s].
double turn_rate(const TeamMember& member) {
  double sum = 0.0;
  for (const ImuMean& mean : member.imu) sum += mean.gyro_radps.norm();
  return sum / static_cast<double>(std::max<std::size_t>(1, member.imu.size()));
}

/// By which the bias of the accelerometer may have changed within an interval.
double vibration_variance(const TeamMember& member) {
  double sum = 0.0;
  for (const ImuMean& mean : member.imu) sum += mean.bias_variance_m2ps4;
  return sum;
}

}  // namespace

double accel_bias_variance(const Priors& priors) {
  return priors.accel_bias_mps2 * priors.accel_bias_mps2 +
         std::pow(priors.accel_scale * kGravityMps2, 2);
}

TeamBelief TeamBelief::beginning(const TeamInterval& interval) {
  TeamBelief belief;
  belief.self = interval.self;
  belief.stamp = interval.from;
  TeamRobot& self = belief.robots[interval.self];
  self.bias_index = belief.append_calibration(interval.settings.priors);
  self.is_trusted = true;
  belief.P(self.clock_index(), self.clock_index()) = kLeastVariance;  // it is what others err from
  return belief;
}

int TeamBelief::append(int count, double sigma) {
  const Eigen::Index n = P.rows();
  Eigen::MatrixXd larger = Eigen::MatrixXd::Zero(n + count, n + count);
  larger.topLeftCorner(n, n) = P;
  larger.diagonal().tail(count).setConstant(std::max(sigma * sigma, kLeastVariance));
  P = std::move(larger);
  return static_cast<int>(n);
}

int TeamBelief::append_calibration(const Priors& priors) {
  const int index = append(kBias, 0.0);
  set_imu_prior(index, priors);
  append(1, std::sqrt(0.5 * kShareOfModules) * priors.range_bias_m);
  append(1, kClockSigma);
  return index;
}

void TeamBelief::set_imu_prior(int bias_index, const Priors& priors) {
  const auto variance = [](double sigma2) { return std::max(sigma2, kLeastVariance); };
  auto diagonal = P.diagonal().segment<kBias>(bias_index);
  diagonal.head<3>().setConstant(variance(priors.gyro_bias_radps * priors.gyro_bias_radps));
  diagonal.segment<3>(3).setConstant(variance(accel_bias_variance(priors)));
  diagonal.tail<9>().setConstant(variance(priors.gyro_scale * priors.gyro_scale));
}

/// The states become independent of all others, and their variance zero.
void TeamBelief::forget(int index, int count) {
  P.middleRows(index, count).setZero();
  P.middleCols(index, count).setZero();
}

void TeamBelief::place(RobotId id, const FreeMotion& motion, const MotionMatrix& covariance) {
  TeamRobot& robot = robots.at(id);
  robot.motion = motion;
  forget(robot.motion_index, kMotion);
  P.block<kMotion, kMotion>(robot.motion_index, robot.motion_index) = covariance;
}

void TeamBelief::connect(RobotId id, RobotId via, const MotionMatrix& by_via,
                         const MotionMatrix& own) {
  const int to = robots.at(id).motion_index;
  const int from = robots.at(via).motion_index;
  forget(to, kMotion);
  const Eigen::MatrixXd rows = by_via * P.middleRows<kMotion>(from);
  const MotionMatrix of_via = rows.middleCols<kMotion>(from) * by_via.transpose();
  P.middleRows<kMotion>(to) = rows;
  P.middleCols<kMotion>(to) = rows.transpose();
  P.block<kMotion, kMotion>(to, to) = own + 0.5 * (of_via + of_via.transpose());
}

void TeamBelief::doubt_imu(RobotId id, const Priors& priors) {
  const int index = robots.at(id).bias_index;
  forget(index, kBias);
  set_imu_prior(index, priors);
}

void TeamBelief::realign(RobotId id, std::size_t camera, const Eigen::Matrix3d& covariance) {
  TeamCamera& knocked = robots.at(id).cameras.at(camera);
  forget(knocked.index, 3);
  P.block<3, 3>(knocked.index, knocked.index) = covariance;
  knocked.is_free = true;
  knocked.agreement.clear();
}

TeamBelief TeamBelief::calibrations_at(const TeamInterval& interval) const {
  TeamBelief belief = *this;
  for (const auto& [id, robot] : robots)
    if (interval.member(id) == nullptr) belief.remove(id);
  for (auto& [id, robot] : belief.robots) {
    for (TeamCamera& camera : robot.cameras) camera.agreement.clear();
    if (robot.motion_index >= 0) belief.place(id, {}, MotionMatrix::Identity());
  }
  for (auto& [pair, range] : belief.ranges) {
    range.agreement.clear();
    range.refused_m.clear();
  }
  belief.add_drift(interval, to_seconds(interval.from - stamp));
  belief.stamp = interval.from;
  return belief;
}

void TeamBelief::erase(int index, int count) {
  const Eigen::Index rest = P.rows() - index - count;
  Eigen::MatrixXd smaller(P.rows() - count, P.rows() - count);
  smaller.topLeftCorner(index, index) = P.topLeftCorner(index, index);
  smaller.topRightCorner(index, rest) = P.topRightCorner(index, rest);
  smaller.bottomLeftCorner(rest, index) = P.bottomLeftCorner(rest, index);
  smaller.bottomRightCorner(rest, rest) = P.bottomRightCorner(rest, rest);
  P = std::move(smaller);
  const auto shift = [&](int& i) { i -= i > index ? count : 0; };
  for (auto& [id, robot] : robots) {
    shift(robot.motion_index);
    shift(robot.bias_index);
    for (TeamCamera& camera : robot.cameras) shift(camera.index);
  }
  for (auto& [pair, range] : ranges) shift(range.index);
}

void TeamBelief::remove(RobotId id) {
  const TeamRobot robot = robots.at(id);
  std::vector<std::pair<int, int>> blocks{{robot.motion_index, kMotion},
                                          {robot.bias_index, TeamRobot::kCalibration}};
  for (const TeamCamera& camera : robot.cameras)
    blocks.emplace_back(camera.index, TeamCamera::kStates);
  for (auto range = ranges.begin(); range != ranges.end();) {
    const bool concerned = range->first.first == id || range->first.second == id;
    if (concerned) blocks.emplace_back(range->second.index, 1);
    range = concerned ? ranges.erase(range) : std::next(range);
  }
  robots.erase(id);
  std::ranges::sort(blocks, std::greater{});
  for (const auto& [index, count] : blocks) erase(index, count);
  for (auto& [other, observer] : robots)
    for (TeamCamera& camera : observer.cameras) camera.agreement.erase(id);
}

void TeamBelief::append_range_biases(const TeamInterval& interval) {
  const double sigma = std::sqrt(1.0 - kShareOfModules) * interval.settings.priors.range_bias_m;
  const auto states = static_cast<int>(P.rows());
  int count = 0;
  for (const TeamRange& reading : interval.ranges) {
    if (!robots.contains(reading.observer) || !robots.contains(reading.neighbor)) continue;
    const RobotPair pair = ordered(reading.observer, reading.neighbor);
    if (ranges.try_emplace(pair, TeamRangeBias{.index = states + count}).second) ++count;
  }
  if (count > 0) append(count, sigma);
}

TeamTrajectories TeamBelief::trajectories(const TeamInterval& interval) const {
  TeamTrajectories paths;
  const double duration_s = to_seconds(interval.to - interval.from);
  for (const TeamMember& member : interval.members) {
    const auto robot = robots.find(member.robot);
    if (robot == robots.end()) continue;
    paths.try_emplace(member.robot, robot->second.motion, robot->second.bias, member.imu,
                      duration_s, interval.settings.noise);
  }
  return paths;
}

GaussianPose TeamBelief::pose(RobotId id) const {
  const TeamRobot& robot = robots.at(id);
  GaussianPose result{{robot.motion.p_F, robot.motion.q_F_B}};
  if (robot.motion_index < 0) return result;
  // The covariance of [p, v, theta] without v.
  const std::array<Eigen::Index, 2> parts{robot.motion_index, robot.motion_index + 6};
  for (Eigen::Index a = 0; a < 2; ++a) {
    for (Eigen::Index b = 0; b < 2; ++b) {
      result.covariance.block<3, 3>(3 * a, 3 * b) =
          P.block<3, 3>(parts.at(std::size_t(a)), parts.at(std::size_t(b)));
    }
  }
  return result;
}

RobotCalibration TeamBelief::calibration(RobotId id) const {
  const TeamRobot& robot = robots.at(id);
  const auto sigma = [this](int index) { return std::sqrt(P(index, index)); };
  const auto sigmas = [this](int index) -> Eigen::Vector3d {
    return P.diagonal().segment<3>(index).cwiseSqrt();
  };
  RobotCalibration calibration{.robot = id,
                               .is_trusted = robot.is_trusted,
                               .imu = {.gyro_radps = robot.bias.gyro_radps,
                                       .accel_mps2 = robot.bias.accel_mps2,
                                       .gyro_scale = robot.bias.gyro_scale,
                                       .gyro_sigma_radps = sigmas(robot.bias_index),
                                       .accel_sigma_mps2 = sigmas(robot.bias_index + 3)},
                               .antenna_delay_m = robot.antenna_delay_m,
                               .antenna_delay_sigma_m = sigma(robot.delay_index()),
                               .clock_s = robot.clock_s,
                               .clock_sigma_s = sigma(robot.clock_index()),
                               .cameras = {}};
  for (int i = 0; i < 3; ++i)
    calibration.imu.gyro_scale_sigma.col(i) = sigmas(robot.bias_index + 6 + 3 * i);
  for (const TeamCamera& camera : robot.cameras) {
    calibration.cameras.push_back({.p_B_C = camera.p_B_C,
                                   .rotation = camera.misalignment,
                                   .covariance = P.block<3, 3>(camera.index, camera.index),
                                   .lens = camera.lens,
                                   .lens_sigma = sigmas(camera.lens_index())});
  }
  return calibration;
}

Eigen::Matrix3d TeamBelief::position_covariance(RobotId from, RobotId to) const {
  const int i = robots.at(from).motion_index;
  const int j = robots.at(to).motion_index;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  if (i >= 0) covariance += P.block<3, 3>(i, i);
  if (j >= 0) covariance += P.block<3, 3>(j, j);
  if (i >= 0 && j >= 0) covariance -= P.block<3, 3>(i, j) + P.block<3, 3>(j, i);
  return covariance;
}

void TeamBelief::inject(const Eigen::VectorXd& dx) {
  for (auto& [id, robot] : robots) {
    if (robot.motion_index >= 0) {
      const auto step = dx.segment<kMotion>(robot.motion_index);
      robot.motion.p_F += step.head<3>();
      robot.motion.v_F += step.segment<3>(3);
      robot.motion.q_F_B = (robot.motion.q_F_B * so3_exp(step.tail<3>())).normalized();
    }
    robot.bias.gyro_radps += dx.segment<3>(robot.bias_index);
    robot.bias.accel_mps2 += dx.segment<3>(robot.bias_index + 3);
    robot.bias.gyro_scale += dx.segment<9>(robot.bias_index + 6).reshaped<Eigen::ColMajor>(3, 3);
    robot.antenna_delay_m += dx(robot.delay_index());
    robot.clock_s += dx(robot.clock_index());
    for (TeamCamera& camera : robot.cameras) {
      camera.misalignment += dx.segment<3>(camera.index);
      camera.lens += dx.segment<3>(camera.lens_index());
    }
  }
  for (auto& [pair, range] : ranges) range.bias_m += dx(range.index);
}

void TeamBelief::reset_attitude(int index, const Eigen::VectorXd& dx) {
  const Eigen::Matrix3d J = so3_right_jacobian(dx.segment<3>(index));
  const Eigen::Matrix<double, 3, Eigen::Dynamic> rows = J * P.middleRows<3>(index);
  const Eigen::Matrix3d own = rows.middleCols<3>(index) * J.transpose();
  P.middleRows<3>(index) = rows;
  P.middleCols<3>(index) = rows.transpose();
  P.block<3, 3>(index, index) = 0.5 * (own + own.transpose());
}
void TeamBelief::advance(const TeamInterval& interval) {
  change_frame(trajectories(interval), *this);
  add_drift(interval, to_seconds(interval.to - interval.from));
  add_vibration(interval);
  stamp = interval.to;
}

void TeamBelief::add_vibration(const TeamInterval& interval) {
  for (const auto& [id, robot] : robots) {
    const TeamMember* const member = interval.member(id);
    if (member == nullptr) continue;
    P.diagonal().segment<3>(robot.bias_index + 3).array() += vibration_variance(*member);
  }
}

/// What changes by itself: the IMUs' biases, and the pairs' range biases, which return to zero.
/// At the turn rates of the interval.
void TeamBelief::add_drift(const TeamInterval& interval, double dt) {
  const ProcessNoise& noise = interval.settings.noise;
  for (auto& [id, robot] : robots) {
    P.diagonal().segment<3>(robot.bias_index).array() += noise.gyro_walk * noise.gyro_walk * dt;
    const double turning =
        interval.settings.priors.accel_scale * kGravityMps2 * turn_rate(*interval.member(id));
    P.diagonal().segment<3>(robot.bias_index + 3).array() +=
        noise.accel_walk * noise.accel_walk * dt + turning * turning * kTurnMemory * dt;
    if (id != self) P(robot.clock_index(), robot.clock_index()) += kClockWalk * kClockWalk * dt;
  }
  const double kept_bias = std::exp(-noise.range_bias_return / (1.0 - kShareOfModules) * dt);
  for (auto& [pair, range] : ranges) {
    range.bias_m *= kept_bias;
    P.row(range.index) *= kept_bias;
    P.col(range.index) *= kept_bias;
    P(range.index, range.index) += noise.range_bias_walk * noise.range_bias_walk * dt;
  }
}

}  // namespace crepes
