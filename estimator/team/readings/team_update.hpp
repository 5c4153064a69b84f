/// The correction of a large state by many measurements at once.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/team/readings/team_measurement.hpp"

namespace crepes {

/// Measurements that depend on a few of many states. What `m` measured dimensions say of `k` states
/// y is summed up first, as information L = H^T R^-1 H with a root C of its rank r, L = C C^T. That
/// equals r measurements C^T y with unit noise, so that all states are corrected by r, and not by m
/// dimensions.
class TeamUpdate {
 public:
  /// `of_y` is the covariance of y, `of_all` that of all states with y. The rows are linearized
  /// `dy` away from the mean (iterated Kalman filter; Bell and Cathey 1993).
  TeamUpdate(const std::vector<TeamRow>& rows, const Eigen::VectorXd& dy,
             const Eigen::MatrixXd& of_y, const Eigen::MatrixXd& of_all);

  /// Withholds the correction of one error, by_states^T x, and of all that goes with it, as far as
  /// its square is not `least` times that of the noise (estimator/relative/parallax.hpp). P is the
  /// covariance of all states x.
  void withhold(const Eigen::VectorXd& by_states, double least, const Eigen::MatrixXd& P);

  /// False if the innovation's covariance is singular. Then nothing else may be called.
  [[nodiscard]] bool is_valid() const { return is_valid_; }
  /// Of all states, from their mean.
  [[nodiscard]] const Eigen::VectorXd& correction() const { return correction_; }
  /// P - G G^T, symmetric to the bit. States that are not `corrected` keep their
  /// covariance, and their correction is to be ignored (Schmidt's filter); their errors count all
  /// the same.
  void correct(const std::vector<bool>& corrected, Eigen::MatrixXd& P) const;

 private:
  Eigen::MatrixXd of_all_;  ///< with those of y that are measured
  Eigen::MatrixXd gain_;    ///< G = of_all gain^T
  Eigen::MatrixXd factor_;  ///< S = factor factor^T, the innovation's covariance
  Eigen::VectorXd correction_;
  Eigen::VectorXd withheld_;  ///< of all states, by the error; empty if nothing is
  Eigen::VectorXd error_G_;   ///< the error's row of G
  bool is_valid_ = false;
};

}  // namespace crepes
