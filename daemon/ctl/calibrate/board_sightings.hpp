/// The boards that a recorded camera saw, identified by their blinking.
#pragma once

#include <vector>

#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "estimator/calibration/camera/camera_problem.hpp"
#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

struct BoardSightings {
  std::vector<RobotId> boards;           ///< in the order of `BoardSighting::board`
  std::vector<BoardSighting> sightings;  ///< by stamp
  double frame_rate_hz = 0.0;            ///< as recorded
};

/// Tracks the spots of the first camera with `camera` as its calibration and reads their codes;
/// `with_gyro` also predicts them by the gyroscope, which needs a rough T_cam_imu. Pictures are
/// searched for spots where there is no spots.csv.
[[nodiscard]] Result<BoardSightings> board_sightings(const RobotRecording& recording,
                                                     const CameraCalibration& camera,
                                                     bool with_gyro);

}  // namespace crepes
