/// A team of robots in the falling frame, as the team's filter receives it.
#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/belief/robot_trajectory.hpp"
#include "estimator/team/belief/team_interval.hpp"
#include "estimator/team/belief/team_state.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::test {

inline constexpr RobotId kSelf{1};
inline constexpr Duration kInterval = std::chrono::milliseconds{100};
inline constexpr double kIntervalSeconds = 0.1;
// Of the mean of an interval's bearings: the errors of lens and spot last longer.
inline constexpr double kBearingSigma = 5e-4;  // rad
inline constexpr double kRangeSigma = 0.05;    // m

inline TeamSettings team_settings() {
  return {.noise = {.gyro_density = 1e-3, .accel_density = 1e-2},
          .priors = {.gyro_bias_radps = 0.005,
                     .accel_bias_mps2 = 0.035,
                     .gyro_scale = 0.003,
                     .range_bias_m = 0.05,
                     .misalignment_rad = radians(0.17),
                     .lens_rad = 6e-4},
          .bearing_gate = 13.8,
          .range_gate = 10.8};
}

/// Robots that swing about their places, with sensors that err as the settings say.
class SimulatedTeam {
 public:
  explicit SimulatedTeam(std::uint64_t seed, int count = 4) : random_(seed) {
    RandomGeometry lenses(seed + 1'000'000);
    for (int i = 0; i < count; ++i) {
      Body& body = bodies_[RobotId{static_cast<std::uint16_t>(i + 1)}];
      const double angle = 2.0 * std::numbers::pi * i / count;
      body.motion = {{4.0 * std::cos(angle), 4.0 * std::sin(angle), random_.uniform(-1.0, 1.0)},
                     Eigen::Vector3d::Zero(),
                     random_.rotation()};
      body.bias = {.gyro_radps = random_.vector(0.005), .accel_mps2 = random_.vector(0.035)};
      body.misalignment = random_.vector(radians(0.17));
      body.antenna_delay_m = random_.normal(range_bias_sigma_m_ * std::sqrt(0.4));
      body.lens = lenses.vector(6e-4);
    }
  }

  /// Which robot sees which, and what a robot measures is changed to.
  std::function<bool(RobotId, RobotId)> sees = [](RobotId, RobotId) { return true; };
  std::function<void(TeamInterval&)> damage = [](TeamInterval&) {};
  /// How late a robot's IMU samples and bearings are stamped, in whole steps of the interval.
  std::map<RobotId, double> late_s;
  /// Whether the robots hover, which their IMUs feel. Their motions relative to each other, which
  /// are all that a team knows, are the same without.
  bool hovers = false;
  /// Whether nobody moves.
  bool rests = false;

  /// Draws the range biases with this sigma, and says so in the settings.
  void bias_ranges(double sigma_m) {
    for (auto& [id, body] : bodies_) body.antenna_delay_m *= sigma_m / range_bias_sigma_m_;
    range_bias_sigma_m_ = sigma_m;
  }

  /// The next interval, with estimates of direct neighbors that are wrong by a little.
  TeamInterval next() {
    TeamInterval interval;
    interval.self = kSelf;
    interval.from = now_;
    interval.to = now_ + kInterval;
    interval.settings = team_settings();
    interval.settings.priors.range_bias_m = range_bias_sigma_m_;
    std::map<RobotId, RobotTrajectory> paths;
    for (auto& [id, body] : bodies_) {
      const std::vector<ImuMean> before = body.imu;
      body.imu = true_imu(body);
      interval.members.push_back(
          {id, p_body_led_, p_body_uwb_, measured(body, late(before, body.imu, late_s[id]))});
      paths.try_emplace(id, body.motion, ImuBias{}, body.imu, kIntervalSeconds, ProcessNoise{});
    }
    for (const auto& [i, from] : bodies_) {
      for (const auto& [j, to] : bodies_) {
        if (i == j) continue;
        const Eigen::Vector3d error = random_.vector(kBearingSigma);
        for (int k = 1; k <= 4 && sees(i, j); ++k)
          interval.bearings.push_back({i, bearing(i, j, 0.024 * k, error, paths)});
        if (i < j) interval.ranges.push_back(range(i, j, paths));
      }
    }
    for (auto& [id, body] : bodies_) body.motion = paths.at(id).end().motion;
    now_ += kInterval;
    for (const auto& [i, from] : bodies_) {
      for (const auto& [j, to] : bodies_)
        if (i != j && sees(i, j) && sees(j, i)) interval.edges.push_back(edge(i, j));
    }
    damage(interval);
    return interval;
  }

  /// T_S_N of a robot at the end of the last interval.
  [[nodiscard]] Pose truth(RobotId robot) const { return relative(kSelf, robot); }
  [[nodiscard]] std::vector<RobotId> robots() const {
    std::vector<RobotId> ids;
    for (const auto& [id, body] : bodies_) ids.push_back(id);
    return ids;
  }
  /// Upwards, in this robot's axes.
  [[nodiscard]] Eigen::Vector3d up() const {
    return bodies_.at(kSelf).motion.q_F_B.conjugate() * Eigen::Vector3d::UnitZ();
  }
  /// In the frame that falls with this robot, at the same time.
  [[nodiscard]] FreeMotion true_motion(RobotId robot) const {
    const FreeMotion& self = bodies_.at(kSelf).motion;
    const Pose T = truth(robot);
    return {T.p, self.q_F_B.conjugate() * (bodies_.at(robot).motion.v_F - self.v_F), T.q};
  }
  [[nodiscard]] const Eigen::Vector3d& misalignment(RobotId robot) const {
    return bodies_.at(robot).misalignment;
  }

 private:
  struct Body {
    FreeMotion motion;
    ImuBias bias;
    Eigen::Vector3d misalignment = Eigen::Vector3d::Zero();
    Eigen::Vector3d lens = Eigen::Vector3d::Zero();
    double antenna_delay_m = 0.0;
    double phase = 0.0;
    std::vector<ImuMean> imu;
  };

  // A force and a rate that swing with a period of some seconds. The frame falls, so gravity is in
  // neither.
  std::vector<ImuMean> true_imu(Body& body) {
    std::vector<ImuMean> imu(10);
    if (rests) return imu;
    for (ImuMean& mean : imu) {
      body.phase += 0.01;
      mean.gyro_radps = 0.5 * Eigen::Vector3d(std::sin(2.0 * body.phase), std::cos(body.phase),
                                              std::sin(1.5 * body.phase));
      const Eigen::Vector3d a_F(std::cos(3.0 * body.phase), std::sin(2.0 * body.phase),
                                std::cos(2.5 * body.phase) + (hovers ? kGravityMps2 : 0.0));
      mean.accel_mps2 = body.motion.q_F_B.conjugate() * a_F;
    }
    return imu;
  }

  // Of this interval by a clock that is ahead.
  static std::vector<ImuMean> late(std::vector<ImuMean> before, const std::vector<ImuMean>& imu,
                                   double late_s) {
    const auto steps = static_cast<std::ptrdiff_t>(std::lround(late_s / 0.01));
    before.insert(before.end(), imu.begin(), imu.end());
    return {before.end() - std::ssize(imu) - std::min(steps, std::ssize(before) - std::ssize(imu)),
            before.end() - steps};
  }

  std::vector<ImuMean> measured(const Body& body, std::vector<ImuMean> imu) {
    for (ImuMean& mean : imu) {
      mean.gyro_radps += body.bias.gyro_radps + random_.vector(1e-3 / std::sqrt(0.01));
      mean.accel_mps2 += body.bias.accel_mps2 + random_.vector(1e-2 / std::sqrt(0.01));
    }
    return imu;
  }

  Bearing bearing(RobotId i, RobotId j, double t_s, const Eigen::Vector3d& error,
                  const std::map<RobotId, RobotTrajectory>& paths) {
    const FreeMotion from = paths.at(i).at(t_s).motion;
    const FreeMotion to = paths.at(j).at(t_s).motion;
    const Eigen::Vector3d d =
        from.q_F_B.conjugate() * (to.p_F + to.q_F_B * p_body_led_ - from.p_F) - p_body_camera_;
    const Body& body = bodies_.at(i);
    const TeamCamera camera{.misalignment = body.misalignment, .lens = body.lens};
    const Eigen::Vector3d u = camera.seen(d.normalized());
    return {.stamp = now_ + from_seconds(t_s + late_s[i]),
            .neighbor = j,
            .u_B = so3_exp(error) * u,
            .p_B_C = p_body_camera_,
            .sigma_rad = kBearingSigma};
  }

  TeamRange range(RobotId i, RobotId j, const std::map<RobotId, RobotTrajectory>& paths) {
    const double t_s = 0.05;
    const FreeMotion from = paths.at(i).at(t_s).motion;
    const FreeMotion to = paths.at(j).at(t_s).motion;
    const double distance =
        (to.p_F + to.q_F_B * p_body_uwb_ - from.p_F - from.q_F_B * p_body_uwb_).norm();
    auto [bias, is_new] = range_bias_.try_emplace({i, j}, 0.0);
    if (is_new) bias->second = random_.normal(range_bias_sigma_m_ * std::sqrt(0.2));
    const double delay_m = bodies_.at(i).antenna_delay_m + bodies_.at(j).antenna_delay_m;
    return {i,
            j,
            now_ + from_seconds(t_s),
            {distance + delay_m + bias->second + random_.normal(kRangeSigma), kRangeSigma}};
  }

  [[nodiscard]] Pose relative(RobotId i, RobotId j) const {
    const FreeMotion& from = bodies_.at(i).motion;
    const FreeMotion& to = bodies_.at(j).motion;
    return {from.q_F_B.conjugate() * (to.p_F - from.p_F), from.q_F_B.conjugate() * to.q_F_B};
  }

  RelativePoseEdge edge(RobotId i, RobotId j) {
    Matrix6d covariance = Matrix6d::Zero();
    covariance.diagonal() << Eigen::Vector3d::Constant(0.0025), Eigen::Vector3d::Constant(3e-4);
    const FreeMotion& from = bodies_.at(i).motion;
    const Eigen::Vector3d v = from.q_F_B.conjugate() * (bodies_.at(j).motion.v_F - from.v_F);
    return {i,
            j,
            {perturbed(relative(i, j), random_.draw<6>(covariance)), covariance},
            v + random_.vector(0.1),
            now_};
  }

  RandomGeometry random_;
  double range_bias_sigma_m_ = 0.05;
  std::map<RobotId, Body> bodies_;
  std::map<std::pair<RobotId, RobotId>, double> range_bias_;
  Timestamp now_ = Timestamp{std::chrono::seconds{10}};
  Eigen::Vector3d p_body_led_{0.0, 0.0, 0.1};
  Eigen::Vector3d p_body_uwb_{0.05, 0.0, 0.12};
  Eigen::Vector3d p_body_camera_{0.0, 0.02, 0.15};
};

}  // namespace crepes::test
