/// A camera's lens, mounting and time shift from boards at rest and the body's own IMU.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "estimator/calibration/camera/camera_solver.hpp"
#include "estimator/calibration/camera/residual_map.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {

/// What is known before: the picture, the first guess, the priors.
struct CameraBatchSettings {
  int width = 0;
  int height = 0;
  LensVector lens = LensVector::Zero();             ///< a rough guess
  Eigen::Vector3d p_B_C = Eigen::Vector3d::Zero();  ///< to 5 cm
  ImuNoise noise;
  Progress on_progress;  ///< optional
};

/// The calibration, its quality, and the reasons to refuse it.
struct CameraBatchResult {
  CameraConstants constants;
  LensVector lens_sigma = LensVector::Zero();
  Eigen::Vector3d rotation_sigma_rad = Eigen::Vector3d::Zero();  ///< about the body's axes
  Eigen::Vector3d position_sigma_m = Eigen::Vector3d::Zero();    ///< of p_B_C
  double shift_sigma_s = 0.0;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();  ///< mean over the recording
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
  double lens_sigma_px = 0.0;  ///< RMS over the image circle, lens and rotation together
  double spot_sigma_px = 0.0;  ///< of a coordinate, from the residuals
  double held_out_px =
      0.0;                ///< the same for seconds, of a grid pictures, that did not enter the fit
  double outliers = 0.0;  ///< share of the sightings
  Eigen::Vector3d rate_rms_radps = Eigen::Vector3d::Zero();  ///< about the body's axes
  Eigen::MatrixXd covariance;  ///< of the constants, in the order of `camera_constants`
  ResidualMap map;
  std::vector<std::string> refusals;
  std::vector<std::string> warnings;
};

/// `names`: the boards, for messages ("board r2"). `sightings` are ordered by stamp. Unknown are
/// the lens, the camera's pose in the body, the time shift, the IMU's biases and matrices, the
/// body's path and the boards' places; see `CameraProblem`.
[[nodiscard]] CameraBatchResult calibrate_camera(std::span<const ImuSample> imu,
                                                 const std::vector<BoardSighting>& sightings,
                                                 const std::vector<std::string>& names,
                                                 const CameraBatchSettings& settings);

/// The same from a first state of one's own, for targets whose places are known better than
/// boards'.
[[nodiscard]] CameraBatchResult calibrate_camera_from(const CameraState& start,
                                                      CameraProblem& problem,
                                                      std::span<const ImuSample> imu,
                                                      const std::vector<std::string>& names,
                                                      const CameraBatchSettings& settings);

}  // namespace crepes
