#include "estimator/vision/camera_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crepes {

Result<CameraModel> CameraModel::from(const CameraConfig& config) {
  const std::vector<double>& k = config.intrinsics;
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::kConfig, "camera " + config.name + ": intrinsics: " + why);
  };
  if (k.size() != 6)
    return refuse("ds takes [xi, alpha, fx, fy, cx, cy], got " + std::to_string(k.size()) +
                  " numbers");
  if (!std::all_of(k.begin(), k.end(), [](double x) { return std::isfinite(x); }))
    return refuse("not finite");
  if (!(k[0] > -1.0 && k[0] < 1.0)) return refuse("xi must lie within (-1, 1)");
  if (!(k[1] >= 0.0 && k[1] <= 1.0)) return refuse("alpha must lie within [0, 1]");
  if (!(k[2] > 0.0 && k[3] > 0.0)) return refuse("fx and fy must be positive");
  if (config.resolution[0] <= 0 || config.resolution[1] <= 0)
    return fail(ErrorCode::kConfig, "camera " + config.name + ": resolution must be positive");

  CameraModel model;
  model.xi_ = k[0];
  model.alpha_ = k[1];
  model.focal_ = {k[2], k[3]};
  model.center_ = {k[4], k[5]};
  const double xi = model.xi_;
  const double alpha = model.alpha_;
  const double w1 = alpha <= 0.5 ? alpha / (1.0 - alpha) : (1.0 - alpha) / alpha;
  model.min_cos_ = -(w1 + xi) / std::sqrt(2.0 * w1 * xi + xi * xi + 1.0);
  model.max_radius2_ =
      alpha > 0.5 ? 1.0 / (2.0 * alpha - 1.0) : std::numeric_limits<double>::infinity();
  model.width_ = config.resolution[0];
  model.height_ = config.resolution[1];
  return model;
}

// Equations 40 to 45:  d1 = |p|,  c = xi d1 + z,  d2 = sqrt(x^2 + y^2 + c^2),
// uv = f (x, y) / (alpha d2 + (1 - alpha) c) + center.
std::optional<Eigen::Vector2d> CameraModel::project(const Eigen::Vector3d& p_C,
                                                    ProjectionJacobian* J) const {
  const double d1 = p_C.norm();
  if (!std::isfinite(d1) || d1 == 0.0 || !(p_C.z() > min_cos_ * d1)) return std::nullopt;
  const double c = xi_ * d1 + p_C.z();
  const double d2 = std::sqrt(p_C.head<2>().squaredNorm() + c * c);
  const double denominator = alpha_ * d2 + (1.0 - alpha_) * c;
  if (!(denominator > 1e-12 * d1)) return std::nullopt;

  const Eigen::Vector2d m = p_C.head<2>() / denominator;
  if (J != nullptr) {
    const Eigen::RowVector3d d_c = xi_ / d1 * p_C.transpose() + Eigen::RowVector3d::UnitZ();
    const Eigen::RowVector3d d_d2 = (Eigen::RowVector3d(p_C.x(), p_C.y(), 0.0) + c * d_c) / d2;
    const Eigen::RowVector3d d_denominator = alpha_ * d_d2 + (1.0 - alpha_) * d_c;
    *J = focal_.asDiagonal() * (ProjectionJacobian::Identity() - m * d_denominator) / denominator;
  }
  return focal_.cwiseProduct(m) + center_;
}

// Equations 46 to 51:  m_z = (1 - alpha^2 r^2) / (alpha s + 1 - alpha),
// s = sqrt(1 - (2 alpha - 1) r^2),  k = (m_z xi + sqrt(m_z^2 + (1 - xi^2) r^2)) / (m_z^2 + r^2),
// u = k m - (0, 0, xi).
std::optional<Eigen::Vector3d> CameraModel::unproject(const Eigen::Vector2d& uv,
                                                      UnprojectionJacobian* J) const {
  const Eigen::Vector2d m_xy = (uv - center_).cwiseQuotient(focal_);
  const double r2 = m_xy.squaredNorm();
  if (!std::isfinite(r2) || !(r2 < max_radius2_)) return std::nullopt;
  const double s = std::sqrt(1.0 - (2.0 * alpha_ - 1.0) * r2);
  const double denominator = alpha_ * s + 1.0 - alpha_;
  const double m_z = (1.0 - alpha_ * alpha_ * r2) / denominator;
  const double norm2 = m_z * m_z + r2;
  const double root = std::sqrt(m_z * m_z + (1.0 - xi_ * xi_) * r2);
  const double k = (m_z * xi_ + root) / norm2;
  const Eigen::Vector3d m(m_xy.x(), m_xy.y(), m_z);

  if (J != nullptr) {
    const double d_mz =
        (alpha_ * (2.0 * alpha_ - 1.0) * m_z / (2.0 * s) - alpha_ * alpha_) / denominator;
    const double d_root = (2.0 * m_z * d_mz + 1.0 - xi_ * xi_) / (2.0 * root);
    const double d_k = (xi_ * d_mz + d_root - k * (2.0 * m_z * d_mz + 1.0)) / norm2;
    const Eigen::RowVector2d d_r2 = 2.0 * m_xy.transpose();
    const Eigen::Vector3d d_m = d_k * m + Eigen::Vector3d(0.0, 0.0, k * d_mz);
    *J = (k * UnprojectionJacobian::Identity() + d_m * d_r2) * focal_.cwiseInverse().asDiagonal();
  }
  return Eigen::Vector3d(k * m.x(), k * m.y(), k * m_z - xi_);
}

bool CameraModel::contains(const Eigen::Vector2d& uv) const {
  return uv.x() >= -0.5 && uv.y() >= -0.5 && uv.x() < width_ - 0.5 && uv.y() < height_ - 0.5;
}

}  // namespace crepes
