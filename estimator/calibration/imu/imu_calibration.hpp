/// Accelerometer and gyroscope from rests in many attitudes.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "estimator/calibration/imu/rests.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {

/// corrected = M (measured - bias), with one-sigma errors of each entry.
struct TriadEstimate {
  Eigen::Matrix3d M = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Matrix3d M_sigma = Eigen::Matrix3d::Zero();
  Eigen::Vector3d bias_sigma = Eigen::Vector3d::Zero();
  double residual_rms = 0.0;  ///< [m/s^2] of gravity's length at rests; [rad] of its direction
                              ///< after turns

  /// M = T K with a unit diagonal in T: K, and T.
  [[nodiscard]] Eigen::Vector3d scale() const { return M.diagonal(); }
  [[nodiscard]] Eigen::Matrix3d misalignment() const {
    return M * M.diagonal().cwiseInverse().asDiagonal();
  }
};

/// What is known before.
struct ImuCalibrationSettings {
  ImuNoise noise;  ///< the random walks; white noise is measured
  double gravity_mps2 = kNominalGravityMps2;
};

struct ImuCalibration {
  TriadEstimate accelerometer;
  TriadEstimate gyroscope;
  RestSearch search;
  int attitudes = 0;                ///< that differ by more than 15 degrees
  double gyro_noise_density = 0.0;  ///< measured at rest
  double accel_noise_density = 0.0;
  std::vector<std::string> refusals;  ///< why this must not be used; empty if it may
  std::vector<std::string> warnings;  ///< what makes it worse than it could be
};

/// The method of Tedaldi, Pretto, Menegatti: "A robust and easy to implement method for IMU
/// calibration without external equipments" (ICRA 2014). At every rest the corrected specific force
/// has the length of gravity (eq. 10); the corrected rate, integrated from one rest to the next,
/// turns the direction of gravity from one to the other (eq. 14). The accelerometer's axes define
/// the body: its M is upper triangular. The gyroscope's bias wanders, so it is measured anew in
/// every rest and smoothed; the one returned is its mean over the recording.
[[nodiscard]] ImuCalibration calibrate_imu(std::span<const ImuSample> samples,
                                           const ImuCalibrationSettings& settings);

}  // namespace crepes
