#include "estimator/relative/arc_pose.hpp"

#include <array>

namespace crepes {
namespace {

constexpr double kLongTail = 2.0;

}  // namespace

// With the attitude error theta, in the axes of B, p = Exp(-theta) p0. Its second order is
//   p_i = theta^T F_i theta / 2,   F_i = (e_i p0^T + p0 e_i^T) / 2 - p0_i I,
// of which a Gaussian theta has the mean tr(F_i S) / 2 and the covariance tr(F_i S F_j S) / 2.
GaussianPose inverse_on_arc(const GaussianPose& T_A_B) {
  GaussianPose result = inverse(T_A_B);
  const Eigen::Vector3d p0 = result.pose.p;
  const Eigen::Matrix3d S = T_A_B.covariance.bottomRightCorner<3, 3>();
  std::array<Eigen::Matrix3d, 3> FS;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Vector3d e = Eigen::Vector3d::Unit(i);
    const Eigen::Matrix3d twice_F = e * p0.transpose() + p0 * e.transpose();
    FS[static_cast<std::size_t>(i)] = 0.5 * twice_F * S - p0(i) * S;
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Matrix3d& FS_i = FS[static_cast<std::size_t>(i)];
    result.pose.p(i) += 0.5 * FS_i.trace();
    for (Eigen::Index j = 0; j < 3; ++j) {
      const Eigen::Matrix3d& FS_j = FS[static_cast<std::size_t>(j)];
      result.covariance(i, j) += kLongTail * 0.5 * FS_i.cwiseProduct(FS_j.transpose()).sum();
    }
  }
  return result;
}

}  // namespace crepes
