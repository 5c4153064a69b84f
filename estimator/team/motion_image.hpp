/// Motions that depend linearly on the states of the team, and their covariance.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/team/robot_trajectory.hpp"

namespace crepes {

/// The error of a robot's motion as a sum of products with runs of states.
struct MotionImage {
  /// The product with a run of states.
  struct Part {
    int from = 0;  ///< the first of the states
    /// The derivative by them.
    Eigen::Matrix<double, FreeMotionAt::kMotion, Eigen::Dynamic, 0, FreeMotionAt::kMotion,
                  FreeMotionAt::kBias>
        by;
  };
  std::vector<Part> parts;  ///< which are added
};

/// Nine columns an image. If the columns of `P` are the covariances of something with all states,
/// the result's are those of the same with the images.
[[nodiscard]] Eigen::MatrixXd covariance_with(const std::vector<MotionImage>& images,
                                              const Eigen::MatrixXd& P);

}  // namespace crepes
