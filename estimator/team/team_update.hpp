/// The correction of a large state by many measurements at once.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/team/team_measurement.hpp"

namespace crepes {

/// The gain of all rows together: with S = H P H^T + R = L L^T, it holds G = P H^T L^-T.
/// It costs n m^2 + n^2 m / 2 for n states and m measured dimensions, because rows are sparse.
class TeamUpdate {
 public:
  TeamUpdate(const std::vector<TeamRow>& rows, const Eigen::MatrixXd& P);

  /// False if S is singular. Then nothing else may be called.
  [[nodiscard]] bool is_valid() const { return is_valid_; }
  /// The correction of the state to which P belongs, for rows that are linearized at a distance
  /// `dx` from it (iterated Kalman filter; Bell and Cathey 1993).
  [[nodiscard]] Eigen::VectorXd correction(const std::vector<TeamRow>& rows,
                                           const Eigen::VectorXd& dx) const;
  /// P - G G^T, symmetric to the bit. States that are not `corrected` keep their covariance, and
  /// their correction is to be ignored (Schmidt's filter); their errors count all the same.
  void correct(const std::vector<bool>& corrected, Eigen::MatrixXd& P) const;

 private:
  Eigen::MatrixXd G_;
  Eigen::MatrixXd L_;
  bool is_valid_ = false;
};

}  // namespace crepes
