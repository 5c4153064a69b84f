/// Where a robot's board is, by its pose.
#pragma once

#include <Eigen/Core>

#include "estimator/core/measurements.hpp"

namespace crepes {

struct ExpectedBoard {
  RobotId robot{};
  Timestamp stamp{};                                        ///< body time
  Eigen::Vector3d p_B_M = Eigen::Vector3d::Zero();          ///< its LED ring [m]
  Eigen::Vector3d v_B_M = Eigen::Vector3d::Zero();          ///< beside own rotation [m/s]
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< of p_B_M
};

}  // namespace crepes
