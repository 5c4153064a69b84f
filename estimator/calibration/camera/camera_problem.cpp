#include "estimator/calibration/camera/camera_problem.hpp"

#include <ceres/jet.h>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/calibration/batch/knot_noise.hpp"
#include "estimator/calibration/camera/camera_cost.hpp"
#include "estimator/calibration/camera/camera_factors.hpp"
#include "estimator/calibration/camera/camera_linearization.hpp"
#include "estimator/calibration/camera/local_state.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

namespace at = camera_constants;

constexpr int kState = ArrowSystem::kState;
constexpr double kKnotSpacing_s = 0.1;
constexpr double kGaugeSigma = 1e-4;    // position and heading of the first knot: free to choose
constexpr double kVelocitySigma = 3.0;  // of the first knot [m/s]
constexpr double kInvalidPx = 200.0;    // what a sighting costs that the lens cannot show

}  // namespace

CameraProblem::CameraProblem(std::span<const ImuSample> imu, std::vector<BoardSighting> sightings,
                             const ImuNoise& noise, CameraPriors priors)
    : imu_(imu), sightings_(std::move(sightings)), noise_(noise), priors_(std::move(priors)) {
  std::erase_if(sightings_, [&](const BoardSighting& s) { return !is_sampled(s.stamp, imu_); });
  weights_.assign(sightings_.size(), 1.0);
  for (std::size_t i = 0; i < imu_.size(); ++i) {
    if (first_sample_.empty() ||
        seconds(imu_[i].stamp) >= seconds(imu_[first_sample_.back()].stamp) + kKnotSpacing_s * 0.95)
      first_sample_.push_back(i);
  }
}

/// Carries the body from a knot to the next, and shows each sighting and the end to the visitor.
template <class T, class Visitor>
void CameraProblem::walk(const CameraState& state, std::size_t knot, Visitor& visitor) const {
  LocalState<T> local(state.constants, state.knots[knot]);
  const std::size_t first = first_sample_[knot];
  const std::size_t last = first_sample_[knot + 1];
  const double shift = state.constants.shift_s;
  const auto rate_of = [&](std::size_t i) -> Vector3<T> {
    return local.M_gyro * (imu_[i].gyro_radps.cast<T>() - local.gyro_bias);
  };
  auto next =
      std::ranges::upper_bound(sightings_, seconds(imu_[first].stamp), {},
                               [&](const BoardSighting& s) { return seconds(s.stamp) + shift; });
  Vector3<T> before = rate_of(first);
  Vector3<T> now = rate_of(first + 1);
  for (std::size_t i = first + 1; i <= last; ++i) {
    const double begin = seconds(imu_[i - 1].stamp);
    const double end = seconds(imu_[i].stamp);
    const Vector3<T> after = i + 1 < imu_.size() ? rate_of(i + 1) : now;
    InertialStep<T> step{.rate = now,
                         .rate_change = (after - before) * T(0.5 / (end - begin)),
                         .accel = local.M_accel * (imu_[i].accel_mps2.cast<T>() - local.accel_bias),
                         .dt = end - begin};
    const Vector3<T> a_W = step.world_acceleration(local.motion.R_W_B, kNominalGravityMps2);
    std::optional<CameraAt<T>> camera;
    for (; next != sightings_.end() && seconds(next->stamp) + shift <= end; ++next) {
      const auto index = static_cast<std::size_t>(next - sightings_.begin());
      const BoardSighting& seen = *next;
      const double weight = weights_[index];
      if (!camera || seen.stamp != (next - 1)->stamp)
        camera = camera_at<T>(local, step, a_W, local.shift + T(seconds(seen.stamp) - begin));
      const auto r =
          spot_residual(local, *camera, state.constants.p_W[seen.board], seen.uv, sigma_px_);
      if (r) {
        visitor.sighting(knot, index, seen.board, *r, weight);
      } else {
        visitor.invalid(0.5 * weight * std::pow(kInvalidPx / sigma_px_, 2));
      }
    }
    advance(step, a_W, local.motion);
    before = now;
    now = after;
  }
  const double dt = seconds(imu_[last].stamp) - seconds(imu_[first].stamp);
  const auto L = knot_whitening(noise_, dt);
  const CameraKnot& end = state.knots[knot + 1];
  const Eigen::Matrix<T, kState, 1> r = L.template cast<T>() * knot_residual<T>(local, end);
  if constexpr (std::is_same_v<T, double>) {
    visitor.imu(knot, r);
  } else {
    Eigen::Matrix<double, kState, kState> J = Eigen::Matrix<double, kState, kState>::Identity();
    Matrix3<double> error;
    const Matrix3<T> turn =
        local.motion.R_W_B.transpose() * end.q_W_B.toRotationMatrix().template cast<T>();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) error(i, j) = turn(i, j).a;
    J.topLeftCorner<3, 3>() = so3_right_jacobian_inverse(small_log<double>(error));
    visitor.imu(knot, r, L * J);
  }
}

/// Heading and position of the first knot are free: they are held where the first guess put them.
template <class Visitor>
void CameraProblem::visit_priors(const CameraState& state, const CameraState& prior,
                                 Visitor& visitor) const {
  const CameraConstants& x = state.constants;
  const CameraConstants& m = prior.constants;
  const auto add = [&](int index, double difference, double sigma) {
    visitor.prior_of_constant(index, difference / sigma, 1.0 / sigma);
  };
  const auto add3 = [&](int index, const Eigen::Vector3d& difference, double sigma) {
    for (int i = 0; i < 3; ++i) add(index + i, difference[i], sigma);
  };
  for (int i = 0; i < 6; ++i) add(at::kLens + i, x.lens[i] - m.lens[i], priors_.lens[i]);
  add3(at::kRotation, so3_log(m.q_C_B.conjugate() * x.q_C_B), priors_.rotation_rad);
  add3(at::kPosition, x.p_B_C - m.p_B_C, priors_.position_m);
  add(at::kShift, x.shift_s - m.shift_s, priors_.shift_s);
  int index = at::kGyroMatrix;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) add(index++, x.M_gyro(i, j) - m.M_gyro(i, j), priors_.imu_matrix);
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) add(index++, x.M_accel(i, j) - m.M_accel(i, j), priors_.imu_matrix);
  if (x.layout == BoardLayout::kRigid) {
    add3(at::kBoards + 3, x.p_W.front() - m.p_W.front(), priors_.board_m);
    add(at::kBoards + kRigidUnknowns - 1, std::log(x.layout_scale / m.layout_scale),
        priors_.layout_scale);
  } else {
    for (std::size_t b = 0; b < x.p_W.size(); ++b)
      add3(at::kBoards + 3 * static_cast<int>(b), x.p_W[b] - m.p_W[b], priors_.board_m);
  }

  const CameraKnot& first = state.knots.front();
  const CameraKnot& held = prior.knots.front();
  const auto add_first = [&](int column, const Eigen::Vector3d& difference, double sigma) {
    for (int i = 0; i < 3; ++i) {
      Eigen::Matrix<double, 1, kState> row = Eigen::Matrix<double, 1, kState>::Zero();
      row(column + i) = 1.0 / sigma;
      visitor.prior_of_first(row, difference[i] / sigma);
    }
  };
  add_first(3, first.v_W, kVelocitySigma);
  add_first(6, first.p_W - held.p_W, kGaugeSigma);
  add_first(9, first.gyro_bias, priors_.gyro_bias_radps);
  add_first(12, first.accel_bias, priors_.accel_bias_mps2);
  Eigen::Matrix<double, 1, kState> heading = Eigen::Matrix<double, 1, kState>::Zero();
  heading.head<3>() = first.q_W_B.toRotationMatrix().row(2) / kGaugeSigma;
  const Eigen::Vector3d turned = first.q_W_B * so3_log(held.q_W_B.conjugate() * first.q_W_B);
  visitor.prior_of_first(heading, turned.z() / kGaugeSigma);
}

double CameraProblem::cost(const CameraState& state, const CameraState& prior) const {
  CameraCost visitor;
  for (std::size_t k = 0; k + 1 < knots(); ++k) walk<double>(state, k, visitor);
  visit_priors(state, prior, visitor);
  return visitor.sum();
}

ArrowSystem CameraProblem::linearize(const CameraState& state, const CameraState& prior) const {
  ArrowSystem system(knots(), at::kBoards + board_unknowns(state.constants));
  CameraLinearization visitor(state.constants, system);
  for (std::size_t k = 0; k + 1 < knots(); ++k) walk<LocalJet>(state, k, visitor);
  visit_priors(state, prior, visitor);
  return system;
}

std::vector<SightingResidual> CameraProblem::residuals(const CameraState& state) const {
  std::vector<SightingResidual> residuals(sightings_.size());
  CameraResiduals visitor(residuals, sigma_px_);
  for (std::size_t k = 0; k + 1 < knots(); ++k) walk<double>(state, k, visitor);
  return residuals;
}

}  // namespace crepes
