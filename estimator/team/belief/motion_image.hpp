/// Motions that depend linearly on the states of the team, and their covariance.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/relative/small_product.hpp"
#include "estimator/team/belief/robot_trajectory.hpp"

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
/// `with` becomes that of the same with the images.
void set_covariance_with(const std::vector<MotionImage>& images, const Eigen::MatrixXd& P,
                         MatrixRef with);

/// Nine rows and columns an image. `with` is the covariance of all states with the images; `own`
/// becomes that of the images, symmetric to the bit.
void set_covariance_of(const std::vector<MotionImage>& images, const ConstMatrixRef& with,
                       MatrixRef own);

}  // namespace crepes
