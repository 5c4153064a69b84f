#include "estimator/calibration/camera/camera_state.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kMostLens = 0.95;  // of xi and alpha

void move_boards(const Eigen::Ref<const Eigen::VectorXd>& d, CameraConstants& constants) {
  if (constants.layout == BoardLayout::kRigid) {
    const Eigen::Vector3d center = constants.p_W.front();
    const Eigen::Quaterniond turn = so3_exp(d.head<3>());
    const double growth = std::exp(d(kRigidUnknowns - 1));
    for (Eigen::Vector3d& p_W : constants.p_W)
      p_W = center + growth * (turn * (p_W - center)) + d.segment<3>(3);
    constants.layout_scale *= growth;
    return;
  }
  for (std::size_t b = 0; b < constants.p_W.size(); ++b)
    constants.p_W[b] += d.segment<3>(3 * static_cast<Eigen::Index>(b));
}

}  // namespace

CameraState moved(const CameraState& state, const ArrowSystem::Step& step) {
  CameraState next = state;
  const Eigen::VectorXd& d = step.constants;
  CameraConstants& c = next.constants;
  c.lens += d.segment<6>(camera_constants::kLens);
  c.lens[0] = std::clamp(c.lens[0], -kMostLens, kMostLens);
  c.lens[1] = std::clamp(c.lens[1], 1.0 - kMostLens, kMostLens);
  c.q_C_B = (c.q_C_B * so3_exp(d.segment<3>(camera_constants::kRotation))).normalized();
  c.p_B_C += d.segment<3>(camera_constants::kPosition);
  c.shift_s += d(camera_constants::kShift);
  int index = camera_constants::kGyroMatrix;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.M_gyro(i, j) += d(index++);
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) c.M_accel(i, j) += d(index++);
  move_boards(d.tail(d.size() - camera_constants::kBoards), c);
  for (std::size_t k = 0; k < next.knots.size(); ++k) {
    CameraKnot& knot = next.knots[k];
    const ArrowSystem::StateVector& s = step.states[k];
    knot.q_W_B = (knot.q_W_B * so3_exp(s.head<3>())).normalized();
    knot.v_W += s.segment<3>(3);
    knot.p_W += s.segment<3>(6);
    knot.gyro_bias += s.segment<3>(9);
    knot.accel_bias += s.segment<3>(12);
  }
  return next;
}

}  // namespace crepes
