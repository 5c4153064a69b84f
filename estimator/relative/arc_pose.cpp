#include "estimator/relative/arc_pose.hpp"

#include <array>

namespace crepes {
namespace {

constexpr double kLongTail = 2.0;

}  // namespace

Eigen::Matrix3d turned_twice(const Eigen::Vector3d& u, const Eigen::Vector3d& arm) {
  return 0.5 * (u * arm.transpose() + arm * u.transpose()) -
         u.dot(arm) * Eigen::Matrix3d::Identity();
}

// With the attitude error theta, in the axes of B, p = Exp(-theta) p0. Its second order along axis
// i is theta^T F_i theta / 2, of which a Gaussian theta has the mean tr(F_i S) / 2 and the
// covariance tr(F_i S F_j S) / 2.
GaussianPose inverse_on_arc(const GaussianPose& T_A_B) {
  GaussianPose result = inverse(T_A_B);
  const Eigen::Vector3d p0 = result.pose.p;
  const Eigen::Matrix3d S = T_A_B.covariance.bottomRightCorner<3, 3>();
  std::array<Eigen::Matrix3d, 3> FS;
  for (Eigen::Index i = 0; i < 3; ++i)
    FS[static_cast<std::size_t>(i)] = turned_twice(Eigen::Vector3d::Unit(i), p0) * S;
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
