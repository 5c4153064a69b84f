/// A camera that looks forward, with the lens of the swarm's own recordings.
#pragma once

#include "estimator/core/camera_calibration.hpp"

namespace crepes {

inline CameraCalibration forward_camera() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.intrinsics = {-0.1723, 0.5931, 316.6, 316.5, 638.2, 513.0};
  camera.resolution = {1280, 1024};
  Eigen::Matrix3d R_C_B;
  R_C_B << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  camera.T_cam_imu = {{0.0, 0.01, -0.06}, Eigen::Quaterniond(R_C_B)};
  return camera;
}

}  // namespace crepes
