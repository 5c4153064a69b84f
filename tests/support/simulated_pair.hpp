/// Two robots that fly smooth figures around each other, and what their sensors say.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/core/imu_history.hpp"
#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/relative/raw_pose.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::test {

/// Changes a robot's velocity at once.
struct Blow {
  double t = 0.0;
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  ///< [m/s]
};

/// One robot's way: sums of sines in position and attitude, a function of time, and blows.
struct SmoothFlight {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d swing = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();   ///< [rad/s]
  Eigen::Vector3d phase = Eigen::Vector3d::Zero();
  double tilt = 0.2;      ///< [rad]
  double yaw_rate = 0.2;  ///< [rad/s]
  std::vector<Blow> blows{};

  [[nodiscard]] Pose T_W_B(double t) const {
    const Eigen::Vector3d s = (rate * t + phase).array().sin();
    const Eigen::Vector3d c = (rate * t + phase).array().cos();
    Eigen::Vector3d p = center + swing.cwiseProduct(s);
    for (const Blow& blow : blows) p += std::max(0.0, t - blow.t) * blow.v_W;
    return {p, so3_exp({0.0, 0.0, yaw_rate * t + phase.z()}) *
                   so3_exp({tilt * c.x(), tilt * c.y(), 0.0})};
  }
  [[nodiscard]] Eigen::Vector3d v_W_B(double t) const {
    const Eigen::Vector3d c = (rate * t + phase).array().cos();
    Eigen::Vector3d v = swing.cwiseProduct(rate).cwiseProduct(c);
    for (const Blow& blow : blows)
      if (t > blow.t) v += blow.v_W;
    return v;
  }
};

struct PairNoise {
  double gyro = 0.004;     ///< [rad/s] a sample
  double accel = 0.02;     ///< [m/s^2] a sample
  double bearing = 0.004;  ///< [rad]
  double range = 0.05;     ///< [m]
  double tilt = 0.01;      ///< [rad]
  Priors priors{.speed_mps = 2.0,
                .gyro_bias_radps = 0.005,
                .accel_bias_mps2 = 0.05,
                .gyro_scale = 0.003,
                .accel_scale = 0.002,
                .range_bias_m = 0.10,
                .misalignment_rad = 0.0035};
};

class SimulatedPair {
 public:
  static constexpr Duration kImuPeriod = std::chrono::milliseconds{10};

  SimulatedPair(std::uint64_t seed, const PairNoise& noise = {}) : random_(seed), noise_(noise) {
    for (SmoothFlight* flight : {&B_, &N_}) {
      flight->swing = {random_.uniform(0.3, 1.0), random_.uniform(0.3, 1.0), 0.3};
      flight->rate = {random_.uniform(0.5, 1.5), random_.uniform(0.5, 1.5), 0.7};
      flight->phase = {random_.uniform(-3, 3), random_.uniform(-3, 3), random_.uniform(-3, 3)};
      flight->yaw_rate = random_.uniform(-0.4, 0.4);
    }
    N_.center = {4.0, 1.0, 0.3};
    for (Mounting* m : {&mounting_B, &mounting_N}) {
      *m = {random_.vector(0.03), random_.vector(0.05), random_.vector(0.05)};
    }
    const Priors& p = noise.priors;
    truth_.bias_B = {random_.vector(p.gyro_bias_radps), random_.vector(p.accel_bias_mps2)};
    truth_.bias_N = {random_.vector(p.gyro_bias_radps), random_.vector(p.accel_bias_mps2)};
    for (ImuBias* bias : {&truth_.bias_B, &truth_.bias_N}) {
      for (double& s : bias->gyro_scale.reshaped()) s = random_.normal(p.gyro_scale);
      for (double& s : bias->accel_scale.reshaped()) s = random_.normal(p.accel_scale);
    }
    truth_.range_bias_m = random_.normal(p.range_bias_m);
    truth_.misalignment_B = random_.vector(p.misalignment_rad);
    truth_.misalignment_N = random_.vector(p.misalignment_rad);
  }

  /// Adds both robots' samples of the intervals that end within (now, to].
  void sample_imus(Timestamp to) {
    for (; sampled_ + kImuPeriod <= to; sampled_ += kImuPeriod) {
      const double t = seconds(sampled_);
      imu_B.push(sample(B_, truth_.bias_B, t));
      imu_N.push(sample(N_, truth_.bias_N, t));
    }
  }

  [[nodiscard]] NominalState truth(Timestamp stamp) const {
    const double t = seconds(stamp);
    const Pose T_W_B = B_.T_W_B(t);
    NominalState state = truth_;
    state.motion.T_B_N = T_W_B.inverse() * N_.T_W_B(t);
    state.motion.v_B_N = T_W_B.q.conjugate() * (N_.v_W_B(t) - B_.v_W_B(t));
    return state;
  }

  [[nodiscard]] DirectionReading bearing(Timestamp stamp) {
    return bearing(stamp, mounting_B.camera, truth_.misalignment_B);
  }
  /// Of another camera on B.
  [[nodiscard]] DirectionReading bearing(Timestamp stamp, const Eigen::Vector3d& p_B_C,
                                         const Eigen::Vector3d& misalignment) {
    return direction(truth(stamp).motion.T_B_N * mounting_N.led, p_B_C, misalignment);
  }
  [[nodiscard]] DirectionReading peer_bearing(Timestamp stamp) {
    const Pose T_N_B = truth(stamp).motion.T_B_N.inverse();
    return direction(T_N_B * mounting_B.led, mounting_N.camera, truth_.misalignment_N);
  }
  [[nodiscard]] RangeReading range(Timestamp stamp) {
    const Pose T_B_N = truth(stamp).motion.T_B_N;
    const double distance = (T_B_N * mounting_N.antenna - mounting_B.antenna).norm();
    return {distance + truth_.range_bias_m + random_.normal(noise_.range), noise_.range};
  }

  /// Both bearings, a range and both tilts at one instant, with the sigmas that belong to them.
  [[nodiscard]] MutualSighting sighting(Timestamp stamp) {
    const auto side = [&](const DirectionReading& u, const Pose& T_W_X, const Mounting& mounting,
                          const ImuBias& bias) {
      const Eigen::Vector3d true_up = T_W_X.q.conjugate() * Eigen::Vector3d::UnitZ();
      const Eigen::Vector3d up =
          (true_up + bias.accel_scale * true_up + bias.accel_mps2 / kGravityMps2).normalized();
      return Sighting{
          .u = u.u,
          .up = (up + tangent_basis(up) * random_.normal_vector<2>(noise_.tilt)).normalized(),
          .mounting = mounting,
          .bearing_sigma_rad = std::hypot(noise_.bearing, noise_.priors.misalignment_rad),
          .tilt_sigma_rad = noise_.tilt};
    };
    const double t = seconds(stamp);
    return {.B = side(bearing(stamp), B_.T_W_B(t), mounting_B, truth_.bias_B),
            .N = side(peer_bearing(stamp), N_.T_W_B(t), mounting_N, truth_.bias_N),
            .range_m = range(stamp).range_m,
            .range_sigma_m = std::hypot(noise_.range, noise_.priors.range_bias_m)};
  }

  /// Both robots move `pace` times as fast from the start. Call before anything is sampled.
  void set_pace(double pace) {
    for (SmoothFlight* flight : {&B_, &N_}) {
      flight->rate *= pace;
      flight->yaw_rate *= pace;
    }
  }

  /// Something hits B, or N: its velocity changes at once.
  void hit_B(Timestamp stamp, const Eigen::Vector3d& v_W) {
    B_.blows.push_back({seconds(stamp), v_W});
  }
  void hit_N(Timestamp stamp, const Eigen::Vector3d& v_W) {
    N_.blows.push_back({seconds(stamp), v_W});
  }

  /// Both robots look with other cameras at the same places from now on.
  void change_cameras() {
    truth_.misalignment_B = random_.vector(noise_.priors.misalignment_rad);
    truth_.misalignment_N = random_.vector(noise_.priors.misalignment_rad);
  }

  [[nodiscard]] ProcessNoise process_noise() const {
    const double root_period = std::sqrt(to_seconds(kImuPeriod));
    return {.gyro_density = noise_.gyro * root_period, .accel_density = noise_.accel * root_period};
  }
  [[nodiscard]] const Priors& priors() const { return noise_.priors; }

  Mounting mounting_B;
  Mounting mounting_N;
  ImuHistory imu_B;
  ImuHistory imu_N;

 private:
  static double seconds(Timestamp t) { return to_seconds(t.time_since_epoch()); }

  // Means over the interval [t, t + period], stamped at its end.
  ImuSample sample(const SmoothFlight& flight, const ImuBias& bias, double t) {
    const double dt = to_seconds(kImuPeriod);
    const Pose before = flight.T_W_B(t);
    const Pose after = flight.T_W_B(t + dt);
    const Eigen::Vector3d w = so3_log(before.q.conjugate() * after.q) / dt;
    const Eigen::Vector3d f_W =
        (flight.v_W_B(t + dt) - flight.v_W_B(t)) / dt + kGravityMps2 * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d f = flight.T_W_B(t + 0.5 * dt).q.conjugate() * f_W;
    return {sampled_ + kImuPeriod,
            w + bias.gyro_scale * w + bias.gyro_radps + random_.vector(noise_.gyro),
            f + bias.accel_scale * f + bias.accel_mps2 + random_.vector(noise_.accel)};
  }

  DirectionReading direction(const Eigen::Vector3d& ring, const Eigen::Vector3d& camera,
                             const Eigen::Vector3d& misalignment) {
    const Eigen::Vector3d u = so3_exp(misalignment) * (ring - camera).normalized();
    return {(u + tangent_basis(u) * random_.normal_vector<2>(noise_.bearing)).normalized(), camera,
            noise_.bearing};
  }

  RandomGeometry random_;
  PairNoise noise_;
  SmoothFlight B_;
  SmoothFlight N_;
  NominalState truth_;  // biases and calibration
  Timestamp sampled_{};
};

}  // namespace crepes::test
