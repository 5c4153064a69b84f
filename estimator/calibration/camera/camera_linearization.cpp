#include "estimator/calibration/camera/camera_linearization.hpp"

#include <ceres/jet.h>

#include "estimator/core/so3.hpp"

namespace crepes {

CameraLinearization::BoardColumns CameraLinearization::columns_of(const CameraConstants& constants,
                                                                  std::size_t board) {
  if (constants.layout == BoardLayout::kFree)
    return {kShared + 3 * static_cast<Eigen::Index>(board), Eigen::Matrix3d::Identity()};
  const Eigen::Vector3d arm_W = constants.p_W[board] - constants.p_W.front();
  BoardColumns columns{kShared, Eigen::Matrix<double, 3, kRigidUnknowns>::Zero()};
  columns.J << -hat(arm_W), Eigen::Matrix3d::Identity(), arm_W;
  return columns;
}

CameraLinearization::CameraLinearization(const CameraConstants& constants, ArrowSystem& system)
    : system_(system) {
  for (std::size_t b = 0; b < constants.p_W.size(); ++b)
    boards_.push_back(columns_of(constants, b));
}

template <class H, class B>
void CameraLinearization::add_local(std::size_t knot, const H& hessian, const B& slope) {
  const Eigen::Matrix<double, kLocal, kLocal> full = hessian;
  const Eigen::Matrix<double, kLocal, 1> b = slope;
  system_.diagonal(knot) += full.template topLeftCorner<kState, kState>();
  system_.gradient(knot) -= b.template head<kState>();
  system_.to_constants(knot).leftCols<kShared>() += full.template topRightCorner<kState, kShared>();
  system_.constants().topLeftCorner<kShared, kShared>() +=
      full.template bottomRightCorner<kShared, kShared>();
  system_.constants_gradient().head<kShared>() -= b.template tail<kShared>();
}

void CameraLinearization::imu(std::size_t knot, const Eigen::Matrix<LocalJet, kState, 1>& r,
                              const Eigen::Matrix<double, kState, kState>& J_next) {
  Eigen::Matrix<double, kState, kLocal> J;
  Eigen::Matrix<double, kState, 1> e;
  for (int i = 0; i < kState; ++i) {
    e(i) = r(i).a;
    J.row(i) = r(i).v.transpose();
  }
  add_local(knot, J.transpose() * J, J.transpose() * e);
  const auto J_knot = J.template leftCols<kState>();
  const auto J_constants = J.template rightCols<kShared>();
  system_.to_next(knot) += J_knot.transpose() * J_next;
  system_.diagonal(knot + 1) += J_next.transpose() * J_next;
  system_.gradient(knot + 1) -= J_next.transpose() * e;
  system_.to_constants(knot + 1).leftCols<kShared>() += J_next.transpose() * J_constants;
}

void CameraLinearization::sighting(std::size_t knot, std::size_t /*index*/, std::size_t board,
                                   const SpotRow& row, double weight) {
  const Eigen::Matrix<double, kLocal, 2> weighted = weight * row.J.transpose();
  add_local(knot, weighted * row.J, weighted * row.r);
  const BoardColumns& columns = boards_[board];
  const Eigen::Index count = columns.J.cols();
  const Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kRigidUnknowns> J_board =
      row.J_board * columns.J;
  const Eigen::Matrix<double, kLocal, Eigen::Dynamic, 0, kLocal, kRigidUnknowns> cross =
      weighted * J_board;
  system_.to_constants(knot).middleCols(columns.begin, count) += cross.topRows<kState>();
  Eigen::MatrixXd& C = system_.constants();
  C.block(0, columns.begin, kShared, count) += cross.bottomRows<kShared>();
  C.block(columns.begin, 0, count, kShared) += cross.bottomRows<kShared>().transpose();
  C.block(columns.begin, columns.begin, count, count) += weight * J_board.transpose() * J_board;
  system_.constants_gradient().segment(columns.begin, count) -=
      weight * J_board.transpose() * row.r;
}

void CameraLinearization::prior_of_constant(int index, double r, double slope) {
  system_.constants()(index, index) += slope * slope;
  system_.constants_gradient()(index) -= slope * r;
}

void CameraLinearization::prior_of_first(const Eigen::Matrix<double, 1, kState>& row, double r) {
  system_.diagonal(0) += row.transpose() * row;
  system_.gradient(0) -= row.transpose() * r;
}

}  // namespace crepes
