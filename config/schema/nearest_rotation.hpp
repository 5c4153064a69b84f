/// Rotations as people write them: matrices of rounded numbers.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SVD>

namespace crepes {

/// The rotation nearest to `R`, whose determinant is positive.
[[nodiscard]] inline Eigen::Quaterniond nearest_rotation(const Eigen::Matrix3d& R) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose()));
}

}  // namespace crepes
