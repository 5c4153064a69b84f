#include "estimator/team/team_update.hpp"

#include <Eigen/Cholesky>

namespace crepes {

TeamUpdate::TeamUpdate(const std::vector<TeamRow>& rows, const Eigen::MatrixXd& P) {
  Eigen::Index m = 0;
  for (const TeamRow& row : rows) m += row.dimension;
  G_.setZero(P.rows(), m);
  Eigen::Index k = 0;
  for (const TeamRow& row : rows) {
    for (int d = 0; d < row.dimension; ++d, ++k) {
      for (int a = 0; a < row.size; ++a)
        G_.col(k) += row.H(d, a) * P.col(row.columns[static_cast<std::size_t>(a)]);
    }
  }
  // Column by column of G, which stays in the cache.
  L_.resize(m, m);
  for (Eigen::Index i = 0; i < m; ++i) {
    k = 0;
    for (const TeamRow& row : rows) {
      if (k > i) break;
      for (int d = 0; d < row.dimension; ++d, ++k) {
        double sum = k == i ? row.variance : 0.0;
        for (int a = 0; a < row.size; ++a)
          sum += row.H(d, a) * G_(row.columns[static_cast<std::size_t>(a)], i);
        L_(i, k) = sum;
      }
    }
  }
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factors(L_);
  is_valid_ = factors.info() == Eigen::Success;
  if (is_valid_) L_.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(G_);
}

Eigen::VectorXd TeamUpdate::correction(const std::vector<TeamRow>& rows,
                                       const Eigen::VectorXd& dx) const {
  Eigen::MatrixXd residual(G_.cols(), 1);
  Eigen::Index k = 0;
  for (const TeamRow& row : rows) {
    Eigen::Vector2d r = row.residual;
    for (int a = 0; a < row.size; ++a)
      r += row.H.col(a) * dx(row.columns[static_cast<std::size_t>(a)]);
    residual.col(0).segment(k, row.dimension) = r.head(row.dimension);
    k += row.dimension;
  }
  L_.triangularView<Eigen::Lower>().solveInPlace(residual);
  return G_ * residual;
}

void TeamUpdate::correct(const std::vector<bool>& corrected, Eigen::MatrixXd& P) const {
  const Eigen::MatrixXd before = P;
  P.selfadjointView<Eigen::Lower>().rankUpdate(G_, -1.0);
  P.triangularView<Eigen::StrictlyUpper>() = P.transpose();
  const auto is_kept = [&](Eigen::Index i) { return !corrected[static_cast<std::size_t>(i)]; };
  for (Eigen::Index j = 0; j < P.cols(); ++j) {
    if (!is_kept(j)) continue;
    for (Eigen::Index i = 0; i < P.rows(); ++i)
      if (is_kept(i)) P(i, j) = before(i, j);
  }
}

}  // namespace crepes
