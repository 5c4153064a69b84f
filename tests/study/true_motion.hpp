/// What an ideal IMU would have felt along a recorded path.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "daemon/ctl/dataset/truth.hpp"

namespace crepes::study {

/// World velocity and body rates at an instant.
struct MotionSample {
  Eigen::Vector3d v_W_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d w_B = Eigen::Vector3d::Zero();  ///< [rad/s], body axes
  Eigen::Vector3d f_B = Eigen::Vector3d::Zero();  ///< specific force [m/s^2], body axes
};

/// Central differences of one robot's truth on a grid of 10 ms.
class TrueMotion {
 public:
  TrueMotion(const SwarmTruth& truth, RobotId robot, double duration_s);

  /// Interpolated; outside the recording the nearest.
  [[nodiscard]] MotionSample at(double true_s) const;

 private:
  std::vector<MotionSample> samples_;
};

}  // namespace crepes::study
