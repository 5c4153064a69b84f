#include "estimator/relative/tilt_filter.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/constants.hpp"
#include "estimator/core/imu_history.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/relative/kalman_update.hpp"

namespace crepes {
namespace {

constexpr double kFirstSigma = 0.15;     // rad; a robot in flight at the first sample, at least
constexpr double kMostFirstSigma = 0.5;  // rad
// Of a robot's tilt in what its acceleration explains: one that turns fast may lean by 30 degrees.
constexpr double kFirstShare = 0.5;
constexpr double kAccelerationTime = 1.0;    // s; how long a robot's acceleration keeps its sign
constexpr double kStillAcceleration = 0.03;  // m/s^2
// A robot that turns at w tilts by w T and accelerates by g w T: with T about a second.
constexpr double kAccelerationPerTurn = 5.0;  // (m/s^2) / (rad/s)
constexpr double kSmoothingTime = 1.0;        // s
constexpr Duration kMaxGap = std::chrono::milliseconds{500};
constexpr int kMinSamples = 20;
constexpr int kTheta = 0;
constexpr int kBias = 3;

}  // namespace

TiltFilter::TiltFilter(const ImuNoise& config) : config_(config) {}

void TiltFilter::start(const ImuSample& sample) {
  q_L_B_ = shortest_rotation(sample.accel_mps2, Eigen::Vector3d::UnitZ());
  gyro_bias_.setZero();
  P_.setZero();
  turning_radps_ = sample.gyro_radps.norm();
  surplus_mps2_ = std::abs(sample.accel_mps2.norm() - kGravityMps2);
  const double sigma =
      std::clamp(kFirstShare * acceleration() / kGravityMps2, kFirstSigma, kMostFirstSigma);
  P_.diagonal().head<3>().setConstant(sigma * sigma);
  P_.diagonal().tail<3>().setConstant(config_.gyroscope_bias_sigma * config_.gyroscope_bias_sigma);
  samples_ = 1;
  last_ = sample;
}

double TiltFilter::acceleration() const {
  return kStillAcceleration + kAccelerationPerTurn * turning_radps_ + surplus_mps2_;
}

bool TiltFilter::add(const ImuSample& sample) {
  if (!is_plausible(sample)) return false;
  if (!last_ || sample.stamp - last_->stamp > kMaxGap) {
    start(sample);
    return true;
  }
  const double dt = to_seconds(sample.stamp - last_->stamp);
  if (dt <= 0.0) return false;
  predict(sample, dt);
  correct(sample, dt);
  last_ = sample;
  ++samples_;
  return true;
}

void TiltFilter::predict(const ImuSample& sample, double dt) {
  const Eigen::Vector3d w = sample.gyro_radps - gyro_bias_;  // the mean since the last sample
  q_L_B_ = (q_L_B_ * so3_exp(w * dt)).normalized();

  Eigen::Matrix<double, 6, 6> F = Eigen::Matrix<double, 6, 6>::Identity();
  F.block<3, 3>(kTheta, kTheta) = so3_exp(w * dt).conjugate().toRotationMatrix();
  F.block<3, 3>(kTheta, kBias) = -dt * so3_right_jacobian(w * dt);
  P_ = (F * P_ * F.transpose()).eval();
  const double scale = config_.gyroscope_scale_sigma * w.norm();
  P_.diagonal().head<3>().array() +=
      dt * (config_.gyroscope_noise_density * config_.gyroscope_noise_density +
            scale * scale * kAccelerationTime);
  P_.diagonal().tail<3>().array() +=
      dt * config_.gyroscope_random_walk * config_.gyroscope_random_walk;
}

void TiltFilter::correct(const ImuSample& sample, double dt) {
  const double force = sample.accel_mps2.norm();
  const double share = std::min(1.0, dt / kSmoothingTime);
  turning_radps_ += share * ((sample.gyro_radps - gyro_bias_).norm() - turning_radps_);
  surplus_mps2_ += share * (std::abs(force - kGravityMps2) - surplus_mps2_);
  if (force < 0.5 * kGravityMps2 || force > 2.0 * kGravityMps2) return;  // falling or thrown about

  // White noise that weighs as much per second as an acceleration of this size and duration.
  const double sigma = acceleration() / kGravityMps2 * std::sqrt(2.0 * kAccelerationTime / dt);

  const Eigen::Vector3d up_B = q_L_B_.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Matrix<double, 3, 2> across = tangent_basis(up_B);
  Innovation<2, 6> z;
  z.residual = across.transpose() * (sample.accel_mps2 / force);
  z.H.setZero();
  z.H.leftCols<3>() = across.transpose() * hat(up_B);
  z.cov_z = sigma * sigma * Eigen::Matrix2d::Identity();
  constexpr double kNoGate = 1e9;  // the noise already covers every acceleration
  const auto outcome = kalman_update(z, kNoGate, P_);
  q_L_B_ = (q_L_B_ * so3_exp(outcome.correction.head<3>())).normalized();
  gyro_bias_ += outcome.correction.tail<3>();
}

std::optional<Tilt> TiltFilter::tilt() const {
  if (samples_ < kMinSamples) return std::nullopt;
  const Eigen::Vector3d up_B = q_L_B_.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Matrix<double, 3, 2> across = tangent_basis(up_B);
  const Eigen::Matrix2d P = across.transpose() * P_.topLeftCorner<3, 3>() * across;
  return Tilt{last_->stamp, up_B, std::sqrt(0.5 * P.trace())};
}

}  // namespace crepes
