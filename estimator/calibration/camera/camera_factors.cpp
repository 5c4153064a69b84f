#include "estimator/calibration/camera/camera_factors.hpp"

#include <ceres/jet.h>

namespace crepes {

std::optional<SpotRow> spot_residual(const LocalState<LocalJet>& local,
                                     const CameraAt<LocalJet>& camera,
                                     const Eigen::Vector3d& board_W, const Eigen::Vector2d& seen,
                                     double sigma_px) {
  constexpr int kLens = 6;
  using SpotJet = ceres::Jet<double, kLens + 3>;
  Eigen::Matrix<double, 3, local_columns::kSize> J_point;
  Eigen::Matrix3d R_C_W;
  Vector3<SpotJet> p_C;
  for (int i = 0; i < 3; ++i) {
    double value = camera.t_C[i].a;
    Eigen::Matrix<double, local_columns::kSize, 1> v = camera.t_C[i].v;
    for (int j = 0; j < 3; ++j) {
      R_C_W(i, j) = camera.R_C_W(i, j).a;
      value += R_C_W(i, j) * board_W[j];
      v += camera.R_C_W(i, j).v * board_W[j];
    }
    J_point.row(i) = v.transpose();
    p_C[i] = SpotJet(value, kLens + i);
  }
  Eigen::Matrix<SpotJet, kLens, 1> lens;
  for (int i = 0; i < kLens; ++i) lens[i] = SpotJet(local.lens[i].a, i);
  const auto uv = project_double_sphere<SpotJet>(lens, p_C);
  if (!uv) return std::nullopt;
  SpotRow row;
  for (int i = 0; i < 2; ++i) {
    const SpotJet& x = (*uv)[i];
    const Eigen::RowVector3d by_point = x.v.tail<3>().transpose() / sigma_px;
    row.r[i] = (x.a - seen[i]) / sigma_px;
    row.J.row(i) = by_point * J_point;
    row.J.row(i).segment<kLens>(local_columns::kConstants + camera_constants::kLens) +=
        x.v.head<kLens>().transpose() / sigma_px;
    row.J_board.row(i) = by_point * R_C_W;
  }
  return row;
}

std::optional<Eigen::Vector2d> spot_residual(const LocalState<double>& local,
                                             const CameraAt<double>& camera,
                                             const Eigen::Vector3d& board_W,
                                             const Eigen::Vector2d& seen, double sigma_px) {
  const auto uv = project_double_sphere<double>(local.lens, camera.R_C_W * board_W + camera.t_C);
  if (!uv) return std::nullopt;
  return Eigen::Vector2d((*uv - seen) / sigma_px);
}

}  // namespace crepes
