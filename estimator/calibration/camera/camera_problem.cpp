#include "estimator/calibration/camera/camera_problem.hpp"

#include <ceres/jet.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <utility>

#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/calibration/batch/knot_noise.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

namespace at = camera_constants;

constexpr double kKnotSpacing_s = 0.1;
constexpr double kGaugeSigma = 1e-4;    // position and heading of the first knot: free to choose
constexpr double kVelocitySigma = 3.0;  // of the first knot [m/s]
constexpr double kInvalidPx = 200.0;    // what a sighting costs that the lens cannot show
constexpr double kMostLens = 0.95;

constexpr int kState = ArrowSystem::kState;
constexpr int kLocal = kState + at::kBoards;  // a knot and the constants without boards
using Jet = ceres::Jet<double, kLocal>;

/// A knot and the constants, each number a parameter.
template <class T>
struct Local {
  Motion<T> motion;
  Vector3<T> gyro_bias;
  Vector3<T> accel_bias;
  Eigen::Matrix<T, 6, 1> lens;
  Matrix3<T> R_C_B;
  Vector3<T> p_B_C;
  T shift;
  Matrix3<T> M_gyro;
  Matrix3<T> M_accel;

  Local(const CameraConstants& constants, const CameraKnot& knot) {
    motion = {seeded_rotation<T>(knot.q_W_B, 0), seeded<T>(knot.v_W, 3), seeded<T>(knot.p_W, 6)};
    gyro_bias = seeded<T>(knot.gyro_bias, 9);
    accel_bias = seeded<T>(knot.accel_bias, 12);
    for (int i = 0; i < 6; ++i) lens[i] = seeded<T>(constants.lens[i], kState + at::kLens + i);
    R_C_B = seeded_rotation<T>(constants.q_C_B, kState + at::kRotation);
    p_B_C = seeded<T>(constants.p_B_C, kState + at::kPosition);
    shift = seeded<T>(constants.shift_s, kState + at::kShift);
    int next = kState + at::kGyroMatrix;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) M_gyro(i, j) = seeded<T>(constants.M_gyro(i, j), next++);
    M_accel.setConstant(T(0.0));
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) M_accel(i, j) = seeded<T>(constants.M_accel(i, j), next++);
  }
};

template <class T>
Eigen::Matrix<T, kState, 1> knot_residual(const Local<T>& end, const CameraKnot& next) {
  Eigen::Matrix<T, kState, 1> r;
  const Matrix3<T> error =
      end.motion.R_W_B.transpose() * next.q_W_B.toRotationMatrix().template cast<T>();
  r << small_log<T>(error), next.v_W.cast<T>() - end.motion.v_W,
      next.p_W.cast<T>() - end.motion.p_W, next.gyro_bias.cast<T>() - end.gyro_bias,
      next.accel_bias.cast<T>() - end.accel_bias;
  return r;
}

/// From the world to the camera at an instant:  p_C = R_C_W p_W + t_C .
template <class T>
struct CameraAt {
  Matrix3<T> R_C_W;
  Vector3<T> t_C;
};

/// After `tau` of a step.
template <class T>
CameraAt<T> camera_at(const Local<T>& local, const InertialStep<T>& step, const Vector3<T>& a_W,
                      const T& tau) {
  const Vector3<T> p_W = local.motion.p_W + local.motion.v_W * tau + a_W * (0.5 * tau * tau);
  const Vector3<T> phi = step.angle(tau);
  Matrix3<T> R_B_W;
  for (int i = 0; i < 3; ++i) {
    const Vector3<T> axis = local.motion.R_W_B.row(i).transpose();
    R_B_W.col(i) = rotated<T>(-phi, axis);
  }
  CameraAt<T> camera{local.R_C_B * R_B_W, {}};
  camera.t_C = -(camera.R_C_W * p_W) - local.R_C_B * local.p_B_C;
  return camera;
}

/// A spot's residual [sigmas] and its derivatives. Many boards are seen by a camera at one instant,
/// so its derivatives are those of `CameraAt`, and the board's and the lens's come on top.
struct SpotRow {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, kLocal> J;
  Eigen::Matrix<double, 2, 3> J_board;
};

std::optional<SpotRow> residual_of(const Local<Jet>& local, const CameraAt<Jet>& camera,
                                   const Eigen::Vector3d& board_W, const Eigen::Vector2d& seen,
                                   double sigma_px) {
  constexpr int kLens = 6;
  using SpotJet = ceres::Jet<double, kLens + 3>;
  Eigen::Matrix<double, 3, kLocal> J_point;
  Eigen::Matrix3d R_C_W;
  Vector3<SpotJet> p_C;
  for (int i = 0; i < 3; ++i) {
    double value = camera.t_C[i].a;
    Eigen::Matrix<double, kLocal, 1> v = camera.t_C[i].v;
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
    row.J.row(i).segment<kLens>(kState + at::kLens) += x.v.head<kLens>().transpose() / sigma_px;
    row.J_board.row(i) = by_point * R_C_W;
  }
  return row;
}

std::optional<Eigen::Vector2d> residual_of(const Local<double>& local,
                                           const CameraAt<double>& camera,
                                           const Eigen::Vector3d& board_W,
                                           const Eigen::Vector2d& seen, double sigma_px) {
  const auto uv = project_double_sphere<double>(local.lens, camera.R_C_W * board_W + camera.t_C);
  if (!uv) return std::nullopt;
  return Eigen::Vector2d((*uv - seen) / sigma_px);
}

/// Sums half the squares.
class CostVisitor {
 public:
  void imu(std::size_t /*knot*/, const Eigen::Matrix<double, kState, 1>& r) {
    sum_ += 0.5 * r.squaredNorm();
  }
  void sighting(std::size_t /*knot*/, std::size_t /*index*/, std::size_t /*board*/,
                const Eigen::Vector2d& r, double weight) {
    sum_ += 0.5 * weight * r.squaredNorm();
  }
  void invalid(double cost) { sum_ += cost; }
  void prior_of_constant(int /*index*/, double r, double /*slope*/) { sum_ += 0.5 * r * r; }
  void prior_of_first(const Eigen::Matrix<double, 1, kState>& /*row*/, double r) {
    sum_ += 0.5 * r * r;
  }
  [[nodiscard]] double sum() const { return sum_; }

 private:
  double sum_ = 0.0;
};

/// The unknowns that move a board, and the derivative of its place by them.
struct BoardColumns {
  Eigen::Index begin = 0;
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 6> J;
};

BoardColumns columns_of(const CameraConstants& constants, std::size_t board) {
  if (constants.layout == BoardLayout::kFree)
    return {at::kBoards + 3 * static_cast<Eigen::Index>(board), Eigen::Matrix3d::Identity()};
  BoardColumns columns{at::kBoards, Eigen::Matrix<double, 3, 6>::Zero()};
  columns.J << -hat(constants.p_W[board] - constants.p_W.front()), Eigen::Matrix3d::Identity();
  return columns;
}

/// Builds the normal equations  J^T J x = -J^T r .
class NormalVisitor {
 public:
  NormalVisitor(const CameraConstants& constants, ArrowSystem& system) : system_(system) {
    for (std::size_t b = 0; b < constants.p_W.size(); ++b)
      boards_.push_back(columns_of(constants, b));
  }

  void imu(std::size_t knot, const Eigen::Matrix<Jet, kState, 1>& r,
           const Eigen::Matrix<double, kState, kState>& J_next) {
    Eigen::Matrix<double, kState, kLocal> J;
    Eigen::Matrix<double, kState, 1> e;
    for (int i = 0; i < kState; ++i) {
      e(i) = r(i).a;
      J.row(i) = r(i).v.transpose();
    }
    add_local(knot, J.transpose() * J, J.transpose() * e);
    const auto J_knot = J.template leftCols<kState>();
    const auto J_constants = J.template rightCols<at::kBoards>();
    system_.to_next(knot) += J_knot.transpose() * J_next;
    system_.diagonal(knot + 1) += J_next.transpose() * J_next;
    system_.gradient(knot + 1) -= J_next.transpose() * e;
    system_.to_constants(knot + 1).leftCols<at::kBoards>() += J_next.transpose() * J_constants;
  }

  void sighting(std::size_t knot, std::size_t /*index*/, std::size_t board, const SpotRow& row,
                double weight) {
    const Eigen::Matrix<double, kLocal, 2> weighted = weight * row.J.transpose();
    add_local(knot, weighted * row.J, weighted * row.r);
    const BoardColumns& columns = boards_[board];
    const Eigen::Index count = columns.J.cols();
    const Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, 6> J_board = row.J_board * columns.J;
    const Eigen::Matrix<double, kLocal, Eigen::Dynamic, 0, kLocal, 6> cross = weighted * J_board;
    system_.to_constants(knot).middleCols(columns.begin, count) += cross.topRows<kState>();
    Eigen::MatrixXd& C = system_.constants();
    C.block(0, columns.begin, at::kBoards, count) += cross.bottomRows<at::kBoards>();
    C.block(columns.begin, 0, count, at::kBoards) += cross.bottomRows<at::kBoards>().transpose();
    C.block(columns.begin, columns.begin, count, count) += weight * J_board.transpose() * J_board;
    system_.constants_gradient().segment(columns.begin, count) -=
        weight * J_board.transpose() * row.r;
  }

  void invalid(double /*cost*/) {}

  void prior_of_constant(int index, double r, double slope) {
    system_.constants()(index, index) += slope * slope;
    system_.constants_gradient()(index) -= slope * r;
  }
  void prior_of_first(const Eigen::Matrix<double, 1, kState>& row, double r) {
    system_.diagonal(0) += row.transpose() * row;
    system_.gradient(0) -= row.transpose() * r;
  }

 private:
  template <class H, class B>
  void add_local(std::size_t knot, const H& hessian, const B& slope) {
    const Eigen::Matrix<double, kLocal, kLocal> full = hessian;
    const Eigen::Matrix<double, kLocal, 1> b = slope;
    system_.diagonal(knot) += full.template topLeftCorner<kState, kState>();
    system_.gradient(knot) -= b.template head<kState>();
    system_.to_constants(knot).leftCols<at::kBoards>() +=
        full.template topRightCorner<kState, at::kBoards>();
    system_.constants().topLeftCorner<at::kBoards, at::kBoards>() +=
        full.template bottomRightCorner<at::kBoards, at::kBoards>();
    system_.constants_gradient().head<at::kBoards>() -= b.template tail<at::kBoards>();
  }

  ArrowSystem& system_;
  std::vector<BoardColumns> boards_;
};

/// Collects the residuals in pixels.
class ResidualVisitor {
 public:
  ResidualVisitor(std::vector<SightingResidual>& residuals, double sigma_px)
      : residuals_(residuals), sigma_px_(sigma_px) {}
  void imu(std::size_t /*knot*/, const Eigen::Matrix<double, kState, 1>& /*r*/) {}
  void sighting(std::size_t /*knot*/, std::size_t index, std::size_t /*board*/,
                const Eigen::Vector2d& r, double /*weight*/) {
    residuals_[index] = {r * sigma_px_, true};
  }
  void invalid(double /*cost*/) {}

 private:
  std::vector<SightingResidual>& residuals_;
  double sigma_px_;
};

void move_boards(const Eigen::Ref<const Eigen::VectorXd>& d, CameraConstants& constants) {
  if (constants.layout == BoardLayout::kRigid) {
    const Eigen::Vector3d center = constants.p_W.front();
    const Eigen::Quaterniond turn = so3_exp(d.head<3>());
    for (Eigen::Vector3d& p_W : constants.p_W)
      p_W = center + turn * (p_W - center) + d.segment<3>(3);
    return;
  }
  for (std::size_t b = 0; b < constants.p_W.size(); ++b)
    constants.p_W[b] += d.segment<3>(3 * static_cast<Eigen::Index>(b));
}

}  // namespace

CameraProblem::CameraProblem(std::span<const ImuSample> imu, std::vector<BoardSighting> sightings,
                             const ImuNoise& noise, CameraPriors priors)
    : imu_(imu),
      sightings_(std::move(sightings)),
      weights_(sightings_.size(), 1.0),
      noise_(noise),
      priors_(std::move(priors)) {
  for (std::size_t i = 0; i < imu_.size(); ++i) {
    if (first_sample_.empty() ||
        seconds(imu_[i].stamp) >= seconds(imu_[first_sample_.back()].stamp) + kKnotSpacing_s * 0.95)
      first_sample_.push_back(i);
  }
}

/// Carries the body from a knot to the next, and shows each sighting and the end to the visitor.
template <class T, class Visitor>
void CameraProblem::walk(const CameraState& state, std::size_t knot, Visitor& visitor) const {
  Local<T> local(state.constants, state.knots[knot]);
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
          residual_of(local, *camera, state.constants.p_W[seen.board], seen.uv, sigma_px_);
      if (r) {
        visitor.sighting(knot, index, seen.board, *r, weight);
      } else {
        visitor.invalid(0.5 * weight * std::pow(kInvalidPx / sigma_px_, 2));
      }
    }
    const T dt(step.dt);
    local.motion.p_W += local.motion.v_W * dt + a_W * (T(0.5) * dt * dt);
    local.motion.v_W += a_W * dt;
    const Vector3<T> phi = step.angle(dt);
    for (int row = 0; row < 3; ++row) {
      const Vector3<T> axis = local.motion.R_W_B.row(row).transpose();
      local.motion.R_W_B.row(row) = rotated<T>(-phi, axis).transpose();
    }
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
  CostVisitor visitor;
  for (std::size_t k = 0; k + 1 < knots(); ++k) walk<double>(state, k, visitor);
  visit_priors(state, prior, visitor);
  return visitor.sum();
}

ArrowSystem CameraProblem::linearize(const CameraState& state, const CameraState& prior) const {
  ArrowSystem system(knots(), at::kBoards + board_unknowns(state.constants));
  NormalVisitor visitor(state.constants, system);
  for (std::size_t k = 0; k + 1 < knots(); ++k) walk<Jet>(state, k, visitor);
  visit_priors(state, prior, visitor);
  return system;
}

std::vector<SightingResidual> CameraProblem::residuals(const CameraState& state) const {
  std::vector<SightingResidual> residuals(sightings_.size());
  ResidualVisitor visitor(residuals, sigma_px_);
  for (std::size_t k = 0; k + 1 < knots(); ++k) walk<double>(state, k, visitor);
  return residuals;
}

CameraState moved(const CameraState& state, const ArrowSystem::Step& step) {
  CameraState next = state;
  const Eigen::VectorXd& d = step.constants;
  CameraConstants& c = next.constants;
  c.lens += d.segment<6>(at::kLens);
  c.lens[0] = std::clamp(c.lens[0], -kMostLens, kMostLens);
  c.lens[1] = std::clamp(c.lens[1], 1.0 - kMostLens, kMostLens);
  c.q_C_B = (c.q_C_B * so3_exp(d.segment<3>(at::kRotation))).normalized();
  c.p_B_C += d.segment<3>(at::kPosition);
  c.shift_s += d(at::kShift);
  int index = at::kGyroMatrix;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.M_gyro(i, j) += d(index++);
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) c.M_accel(i, j) += d(index++);
  move_boards(d.tail(d.size() - at::kBoards), c);
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
