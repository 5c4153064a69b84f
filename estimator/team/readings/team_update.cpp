#include "estimator/team/readings/team_update.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "estimator/relative/small_product.hpp"

namespace crepes {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Blocks of a large covariance that stay in the cache.
constexpr Index kBlock = 64;
// Information that is lost in rounding, of states with variance one.
constexpr double kNoInformation = 1e-9;
constexpr double kRounding = 1e-12;

/// L y = b, of those states that are measured at all.
struct Information {
  std::vector<int> states;
  MatrixXd L;
  VectorXd b;
};

Information information_of(const std::vector<TeamRow>& rows, const VectorXd& dy) {
  MatrixXd L = MatrixXd::Zero(dy.size(), dy.size());
  VectorXd b = VectorXd::Zero(dy.size());
  for (const TeamRow& row : rows) {
    const auto column = [&row](int a) { return row.columns[static_cast<std::size_t>(a)]; };
    const double weight = 1.0 / row.variance;
    Eigen::Vector2d residual = row.residual;
    for (int a = 0; a < row.size; ++a) residual += row.H.col(a) * dy(column(a));
    for (int a = 0; a < row.size; ++a) {
      const Eigen::Vector2d weighed =
          weight * (row.dimension == 2 ? row.H.col(a).eval() : Eigen::Vector2d(row.H(0, a), 0.0));
      b(column(a)) += weighed.dot(residual);
      for (int other = 0; other < row.size; ++other)
        L(column(other), column(a)) += weighed.dot(row.H.col(other));
    }
  }
  Information information;
  for (Index i = 0; i < dy.size(); ++i)
    if (L(i, i) > 0.0) information.states.push_back(static_cast<int>(i));
  information.L = L(information.states, information.states);
  information.b = b(information.states);
  return information;
}

/// Measurements with unit noise: root y = z + noise.
struct Root {
  MatrixXd root;  ///< a row each
  VectorXd z;
};

/// L = C C^T with the largest remaining diagonal first, until what is left is rounding. `root` is
/// C^T, and C z = b.
Root root_of(const MatrixXd& L, const VectorXd& b) {
  const Index k = L.rows();
  MatrixXd root = MatrixXd::Zero(k, k);
  VectorXd z = VectorXd::Zero(k);
  VectorXd rest = L.diagonal();
  const double least = kNoInformation + kRounding * (k > 0 ? rest.maxCoeff() : 0.0);
  std::vector<Index> open(static_cast<std::size_t>(k));
  for (Index i = 0; i < k; ++i) open[static_cast<std::size_t>(i)] = i;
  Index r = 0;
  while (!open.empty()) {
    const auto largest = std::ranges::max_element(open, {}, [&](Index i) { return rest(i); });
    const Index pivot = *largest;
    if (!(rest(pivot) > least)) break;
    open.erase(largest);
    const double scale = 1.0 / std::sqrt(rest(pivot));
    const auto before = root.col(pivot).head(r);
    root(r, pivot) = scale * rest(pivot);
    z(r) = scale * (b(pivot) - before.dot(z.head(r)));
    for (const Index i : open) {
      const double entry = scale * (L(i, pivot) - before.dot(root.col(i).head(r)));
      root(r, i) = entry;
      rest(i) -= entry * entry;
    }
    ++r;
  }
  return {root.topRows(r), z.head(r)};
}

/// C += A B^T by blocks of rows.
void add_large_product(const MatrixXd& A, const MatrixXd& B, MatrixXd& C) {
  for (Index i = 0; i < C.rows(); i += kBlock) {
    const Index rows = std::min(kBlock, C.rows() - i);
    add_product(A.middleRows(i, rows), B, C.middleRows(i, rows));
  }
}

/// P -= G G^T. P is symmetric to the bit afterwards: its lower half counts.
void subtract_square(const MatrixXd& G, MatrixXd& P) {
  const Index n = P.rows();
  for (Index i = 0; i < n; i += kBlock) {
    const Index rows = std::min(kBlock, n - i);
    subtract_product(G.middleRows(i, rows), G.topRows(i + rows), P.block(i, 0, rows, i + rows));
    if (i > 0) P.block(0, i, i, rows) = P.block(i, 0, rows, i).transpose();
    auto square = P.block(i, i, rows, rows);
    square.triangularView<Eigen::StrictlyUpper>() = square.transpose();
  }
}

}  // namespace

TeamUpdate::TeamUpdate(const std::vector<TeamRow>& rows, const VectorXd& dy, const MatrixXd& of_y,
                       const MatrixXd& of_all) {
  const Information information = information_of(rows, dy);
  const MatrixXd P_y = of_y(information.states, information.states);
  const VectorXd sigma = P_y.diagonal().cwiseMax(0.0).cwiseSqrt();
  Root by_y = root_of(sigma.asDiagonal() * information.L * sigma.asDiagonal(),
                      sigma.cwiseProduct(information.b));
  // In the states' own units again. What is known exactly is not corrected.
  const VectorXd per_sigma = (sigma.array() > 0.0).select(sigma.cwiseInverse(), 0.0);
  by_y.root = (by_y.root * per_sigma.asDiagonal()).eval();
  const Index r = by_y.root.rows();
  MatrixXd root_P = MatrixXd::Zero(r, P_y.rows());
  add_large_product(by_y.root, P_y, root_P);
  MatrixXd S = MatrixXd::Identity(r, r);
  add_large_product(root_P, by_y.root, S);
  const Eigen::LLT<MatrixXd> factors(S);
  is_valid_ = factors.info() == Eigen::Success && S.allFinite() && by_y.root.allFinite();
  if (!is_valid_) return;
  factor_ = factors.matrixL();
  gain_ = std::move(by_y.root);
  factors.matrixL().solveInPlace(gain_);
  factors.matrixL().solveInPlace(by_y.z);
  of_all_ = of_all(Eigen::all, information.states);
  correction_ = of_all_ * (gain_.transpose() * by_y.z);
}

void TeamUpdate::withhold(const VectorXd& by_states, double least, const MatrixXd& P) {
  const VectorXd with_error = P * by_states;
  const double variance = by_states.dot(with_error);
  if (!(variance > 0.0)) return;
  error_G_ = gain_ * (of_all_.transpose() * by_states);
  // What is measured of the error, for a unit of it and with unit noise, and how it errs besides.
  const VectorXd seen = factor_.triangularView<Eigen::Lower>() * error_G_ / variance;
  const double seen2 = seen.squaredNorm();
  const VectorXd across = factor_.triangularView<Eigen::Lower>().transpose() * seen;
  const double noise =
      std::max(0.0, across.squaredNorm() - seen2 - variance * seen2 * seen2);  // of rounding
  const double share = seen2 * seen2 > least * noise ? least * noise / (seen2 * seen2) : 1.0;
  withheld_ = share / variance * with_error;
  correction_ -= by_states.dot(correction_) * withheld_;
}

void TeamUpdate::correct(const std::vector<bool>& corrected, MatrixXd& P) const {
  MatrixXd G = MatrixXd::Zero(P.rows(), gain_.rows());
  add_large_product(of_all_, gain_, G);
  const bool are_all_corrected = std::ranges::all_of(corrected, std::identity{});
  const MatrixXd before = are_all_corrected ? MatrixXd() : P;
  subtract_square(G, P);
  if (withheld_.size() > 0) {
    const VectorXd kept = error_G_.norm() * withheld_;
    P.noalias() += kept * kept.transpose();
  }
  if (are_all_corrected) return;
  const auto is_kept = [&](Index i) { return !corrected[static_cast<std::size_t>(i)]; };
  for (Index j = 0; j < P.cols(); ++j) {
    if (!is_kept(j)) continue;
    // Joseph's form for the gain that corrects neither this state nor what is withheld.
    const double rest =
        withheld_.size() > 0 ? G.row(j).dot(error_G_) - error_G_.squaredNorm() * withheld_(j) : 0.0;
    for (Index i = 0; i < P.rows(); ++i) {
      if (is_kept(i)) {
        P(i, j) = before(i, j);
      } else if (rest != 0.0) {
        P(i, j) = P(j, i) += rest * withheld_(i);
      }
    }
  }
}

}  // namespace crepes
