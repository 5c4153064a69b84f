#include "estimator/calibration/grid/grid_fit.hpp"

#include <ceres/jet.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <utility>

#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/calibration/batch/robust.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kLost_px = 100.0;  // residual of an LED that the lens cannot show

Eigen::Vector3d place_of(const GridLed& led, const GridShape& shape) {
  return {shape.pitch_m * led.column, shape.pitch_m * led.row, 0.0};
}

/// Kannala and Brandt 2006 as in `KannalaBrandt`: fx, fy, cx, cy, k1 to k4.
template <class T>
std::optional<Eigen::Matrix<T, 2, 1>> project_kannala_brandt(const Eigen::Matrix<T, 8, 1>& lens,
                                                             const Vector3<T>& p_C) {
  using std::atan2;
  using std::sqrt;
  const T rho2 = p_C.x() * p_C.x() + p_C.y() * p_C.y();
  if (!(rho2 > T(1e-16))) return Eigen::Matrix<T, 2, 1>(lens[2], lens[3]);
  const T rho = sqrt(rho2);
  const T t = atan2(rho, p_C.z());
  const T t2 = t * t;
  const T slope = T(1.0) + t2 * (3.0 * lens[4] +
                                 t2 * (5.0 * lens[5] + t2 * (7.0 * lens[6] + t2 * 9.0 * lens[7])));
  if (!(slope > T(0.0))) return std::nullopt;
  const T radius = t * (T(1.0) + t2 * (lens[4] + t2 * (lens[5] + t2 * (lens[6] + t2 * lens[7]))));
  return Eigen::Matrix<T, 2, 1>(lens[0] * radius * p_C.x() / rho + lens[2],
                                lens[1] * radius * p_C.y() / rho + lens[3]);
}

/// Seen less expected, and its derivatives by the lens and by the pose [p, theta (right)].
struct LedRow {
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, Eigen::Dynamic> J;
};

template <int kNumbers, class Project>
std::optional<LedRow> row_of(const GridLens& lens, const Pose& T_C_G, const Eigen::Vector3d& p_G,
                             const Eigen::Vector2d& uv, const Project& project) {
  using Jet = ceres::Jet<double, kNumbers + 6>;
  Eigen::Matrix<Jet, kNumbers, 1> numbers;
  for (int i = 0; i < kNumbers; ++i) numbers[i] = Jet(lens.numbers[i], i);
  const Vector3<Jet> p_C = seeded_rotation<Jet>(T_C_G.q, kNumbers + 3) * p_G.cast<Jet>() +
                           seeded<Jet>(T_C_G.p, kNumbers);
  const auto seen = project(numbers, p_C);
  if (!seen) return std::nullopt;
  LedRow row;
  row.residual = uv - Eigen::Vector2d((*seen)[0].a, (*seen)[1].a);
  row.J.resize(2, kNumbers + 6);
  row.J.row(0) = (*seen)[0].v.transpose();
  row.J.row(1) = (*seen)[1].v.transpose();
  return row;
}

std::optional<LedRow> row_of(const GridLens& lens, const Pose& T_C_G, const Eigen::Vector3d& p_G,
                             const Eigen::Vector2d& uv) {
  if (lens.kind == LensKind::kDoubleSphere) {
    return row_of<6>(lens, T_C_G, p_G, uv, [](const auto& numbers, const auto& p_C) {
      return project_double_sphere(numbers, p_C);
    });
  }
  return row_of<8>(lens, T_C_G, p_G, uv, [](const auto& numbers, const auto& p_C) {
    return project_kannala_brandt(numbers, p_C);
  });
}

std::optional<Eigen::Vector2d> project(const GridLens& lens, const Eigen::Vector3d& p_C) {
  if (lens.kind == LensKind::kDoubleSphere)
    return project_double_sphere<double>(lens.numbers.head<6>(), p_C);
  return project_kannala_brandt<double>(lens.numbers.head<8>(), p_C);
}

/// Lens and poses, and what moves while they are searched.
struct Guess {
  GridLens lens;
  std::vector<GridView> views;
};

std::vector<SightingResidual> residuals_of(const Guess& guess, const GridShape& shape) {
  std::vector<SightingResidual> residuals;
  for (const GridView& view : guess.views) {
    for (const GridLed& led : view.leds) {
      const auto seen = project(guess.lens, view.T_C_G * place_of(led, shape));
      residuals.push_back(seen ? SightingResidual{led.uv - *seen, true} : SightingResidual{});
    }
  }
  return residuals;
}

double cost_of(const std::vector<SightingResidual>& residuals, const std::vector<double>& weights) {
  double cost = 0.0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    cost +=
        weights[i] * (residuals[i].is_valid ? residuals[i].uv.squaredNorm() : kLost_px * kLost_px);
  }
  return cost;
}

/// One sigma of a coordinate, from the median of the squared lengths.
double sigma_of(const std::vector<SightingResidual>& residuals) {
  std::vector<double> squares;
  squares.reserve(residuals.size());
  for (const SightingResidual& residual : residuals)
    squares.push_back(residual.is_valid ? residual.uv.squaredNorm() : kLost_px * kLost_px);
  if (squares.empty()) return kLost_px;
  return robust_sigma_px(std::move(squares));
}

std::vector<double> weights_of(const std::vector<SightingResidual>& residuals, double sigma_px) {
  std::vector<double> weights;
  weights.reserve(residuals.size());
  for (const SightingResidual& residual : residuals) {
    weights.push_back(residual.is_valid ? robust_weight(residual.uv.squaredNorm(), sigma_px, 2.0)
                                        : 0.0);
  }
  return weights;
}

/// Normal equations whose views are eliminated one by one (Schur's complement).
class GridEquations {
 public:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  GridEquations(const Guess& guess, const GridShape& shape, const std::vector<double>& weights)
      : H_lens_(Eigen::MatrixXd::Zero(guess.lens.numbers.size(), guess.lens.numbers.size())),
        g_lens_(Eigen::VectorXd::Zero(guess.lens.numbers.size())) {
    const Eigen::Index n = guess.lens.numbers.size();
    std::size_t i = 0;
    for (const GridView& view : guess.views) {
      Block block{Matrix6::Zero(), Eigen::MatrixXd::Zero(n, 6), Vector6::Zero()};
      for (const GridLed& led : view.leds) {
        const double weight = weights[i++];
        const auto row = row_of(guess.lens, view.T_C_G, place_of(led, shape), led.uv);
        if (!row || weight == 0.0) continue;
        const auto J_lens = row->J.leftCols(n);
        const auto J_pose = row->J.rightCols<6>();
        H_lens_ += weight * J_lens.transpose() * J_lens;
        g_lens_ += weight * J_lens.transpose() * row->residual;
        block.H += weight * J_pose.transpose() * J_pose;
        block.H_lens += weight * J_lens.transpose() * J_pose;
        block.g += weight * J_pose.transpose() * row->residual;
      }
      blocks_.push_back(std::move(block));
    }
  }

  /// The guess after a step damped by this share of the diagonal.
  [[nodiscard]] Guess moved(const Guess& guess, double damping, GridUnknowns unknowns) const {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(g_lens_.size());
    if (unknowns == GridUnknowns::kLensAndPoses) {
      Eigen::MatrixXd S = damped(H_lens_, damping);
      Eigen::VectorXd g = g_lens_;
      for (const Block& block : blocks_) {
        const Eigen::LDLT<Matrix6> H(damped(block.H, damping));
        S -= block.H_lens * H.solve(block.H_lens.transpose());
        g -= block.H_lens * H.solve(block.g);
      }
      step = S.ldlt().solve(g);
    }
    Guess next = guess;
    next.lens.numbers += step;
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      const Vector6 d = Eigen::LDLT<Matrix6>(damped(blocks_[k].H, damping))
                            .solve(blocks_[k].g - blocks_[k].H_lens.transpose() * step);
      Pose& T_C_G = next.views[k].T_C_G;
      T_C_G.p += d.head<3>();
      T_C_G.q = (T_C_G.q * so3_exp(d.tail<3>())).normalized();
    }
    return next;
  }

  /// Of the lens, for residuals of one pixel; empty if it is not determined.
  [[nodiscard]] Eigen::MatrixXd lens_covariance() const {
    Eigen::MatrixXd S = H_lens_;
    for (const Block& block : blocks_) {
      S -= block.H_lens * Eigen::LDLT<Matrix6>(damped(block.H, 1e-12))
                              .solve(Eigen::MatrixXd(block.H_lens.transpose()));
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(S);
    if (factor.info() != Eigen::Success) return {};
    return factor.solve(Eigen::MatrixXd::Identity(S.rows(), S.cols()));
  }

 private:
  struct Block {
    Matrix6 H;
    Eigen::MatrixXd H_lens;
    Vector6 g;
  };

  template <class Matrix>
  static Matrix damped(Matrix H, double damping) {
    H.diagonal() += damping * H.diagonal();
    H.diagonal().array() += 1e-12;
    return H;
  }

  Eigen::MatrixXd H_lens_;
  Eigen::VectorXd g_lens_;
  std::vector<Block> blocks_;
};

/// Whether it has converged.
bool descend(Guess& guess, const GridShape& shape, const std::vector<double>& weights, int most,
             GridUnknowns unknowns) {
  constexpr double kMostDamping = 1e8;
  constexpr double kStep = 6.0;
  constexpr double kCostTolerance = 1e-7;
  double damping = 1e-4;
  double cost = cost_of(residuals_of(guess, shape), weights);
  for (int i = 0; i < most; ++i) {
    const GridEquations equations(guess, shape, weights);
    bool is_better = false;
    for (; !is_better && damping < kMostDamping; damping *= is_better ? 1.0 / kStep : kStep) {
      Guess next = equations.moved(guess, damping, unknowns);
      if (!next.lens.is_valid()) continue;
      const double next_cost = cost_of(residuals_of(next, shape), weights);
      if (!(next_cost < cost)) continue;
      is_better = true;
      const bool is_done = cost - next_cost < kCostTolerance * cost;
      guess = std::move(next);
      cost = next_cost;
      if (is_done) return true;
    }
    if (!is_better) return true;
  }
  return false;
}

GridFit finished(Guess guess, const GridShape& shape, bool has_converged) {
  GridFit fit;
  fit.residuals = residuals_of(guess, shape);
  fit.sigma_px = sigma_of(fit.residuals);
  const std::vector<double> weights = weights_of(fit.residuals, fit.sigma_px);
  fit.covariance =
      fit.sigma_px * fit.sigma_px * GridEquations(guess, shape, weights).lens_covariance();
  fit.outliers = outlier_share(weights);
  fit.has_converged = has_converged;
  fit.lens = std::move(guess.lens);
  fit.views = std::move(guess.views);
  return fit;
}

}  // namespace

std::optional<Pose> grid_pose(const std::vector<GridLed>& leds, const GridLens& lens,
                              const GridShape& shape) {
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  Matrix9 A = Matrix9::Zero();
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> pairs;
  for (const GridLed& led : leds) {
    const auto u_C = lens.direction(led.uv);
    if (!u_C) continue;
    const Eigen::Vector3d x(led.column, led.row, 1.0);  // in pitches: numbers of like size
    Eigen::Matrix<double, 3, 9> J;                      // u x (H x) = 0, H by columns
    for (Eigen::Index k = 0; k < 3; ++k) J.middleCols<3>(3 * k) = hat(*u_C) * x[k];
    A += J.transpose() * J;
    pairs.emplace_back(*u_C, x);
  }
  if (pairs.size() < 4) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Matrix9> eigen(A);
  Eigen::Matrix3d H = Eigen::Map<const Eigen::Matrix3d>(eigen.eigenvectors().col(0).data());
  double sign = 0.0;
  for (const auto& [u_C, x] : pairs) sign += u_C.dot(H * x);
  if (sign < 0.0) H = -H;
  const double scale = 0.5 * (H.col(0).norm() + H.col(1).norm());
  if (!(scale > 1e-9)) return std::nullopt;
  H /= scale;
  Eigen::Matrix3d axes;
  axes << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d R = svd.matrixU() * svd.matrixV().transpose();
  if (R.determinant() < 0.0) return std::nullopt;
  return Pose{shape.pitch_m * H.col(2), Eigen::Quaterniond(R)};
}

GridFit fit_grid(const GridLens& lens, std::vector<GridView> views, const GridShape& shape,
                 GridUnknowns unknowns) {
  struct Stage {
    double least_sigma_px;
    int iterations;
  };
  constexpr std::array<Stage, 5> kStages{{{10.0, 30}, {2.0, 30}, {0.0, 30}, {0.0, 20}, {0.0, 20}}};
  Guess guess{lens, std::move(views)};
  bool has_converged = false;
  for (const Stage& stage : kStages) {
    const auto residuals = residuals_of(guess, shape);
    const auto weights = weights_of(residuals, std::max(stage.least_sigma_px, sigma_of(residuals)));
    has_converged = descend(guess, shape, weights, stage.iterations, unknowns);
  }
  return finished(std::move(guess), shape, has_converged);
}

GridFit try_grid(const GridLens& lens, std::vector<GridView> views, const GridShape& shape) {
  constexpr int kIterations = 15;
  Guess guess{lens, std::move(views)};
  const std::vector<double> all(residuals_of(guess, shape).size(), 1.0);
  const bool has_converged = descend(guess, shape, all, kIterations, GridUnknowns::kLensAndPoses);
  return finished(std::move(guess), shape, has_converged);
}

}  // namespace crepes
