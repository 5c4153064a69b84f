#include "estimator/team/trust/misalignment_check.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "estimator/core/constants.hpp"
#include "estimator/team/trust/team_faults.hpp"

namespace crepes {
namespace {

// Sigmas of a turned camera about the axis of its turn, and across.
constexpr double kTurn = radians(20.0);       // rad
constexpr double kTurnAcross = radians(2.0);  // rad

/// A camera that may be turned has no prior that draws its estimate to zero.
MisalignmentCheck tested_without_prior(const TeamBelief& belief, const TeamCamera& camera,
                                       const Priors& priors) {
  const Eigen::Matrix3d covariance =
      belief.P.block<3, 3>(camera.index, camera.index) +
      std::pow(believed_misalignment(priors), 2) * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d& m = camera.misalignment;
  return {.chi2 = m.dot(covariance.llt().solve(m)), .turn = m};
}

}  // namespace

/// The prior draws the estimate to zero, so a turn is significant long before the estimate is
/// large. The difference of two estimates, the second of which uses more data, has the difference
/// of their covariances (Hausman 1978). In the axes of that difference, the data alone give the
/// mean m P0 / (P0 - P) and the variance P P0 / (P0 - P).
MisalignmentCheck misalignment_check(const TeamBelief& belief, const TeamCamera& camera,
                                     const Priors& priors) {
  // A share of the prior's variance. An axis that taught less is unknown.
  constexpr double kObserved = 1e-4;
  if (camera.is_free) return tested_without_prior(belief, camera, priors);
  const double prior = std::max(std::pow(priors.misalignment_rad, 2), TeamBelief::kLeastVariance);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> learned(
      prior * Eigen::Matrix3d::Identity() - belief.P.block<3, 3>(camera.index, camera.index));
  MisalignmentCheck check;
  for (int i = 0; i < 3; ++i) {
    const double difference = learned.eigenvalues()(i);
    if (difference < kObserved * prior) continue;
    const Eigen::Vector3d axis = learned.eigenvectors().col(i);
    const double mean = axis.dot(camera.misalignment) * prior / difference;
    const double variance = (prior - difference) * prior / difference;
    const double chi2 = mean * mean / (variance + std::pow(believed_misalignment(priors), 2));
    check.chi2 += chi2;
    check.turn += chi2 * mean * axis;
  }
  return check;
}

Eigen::Matrix3d turned_covariance(const Eigen::Vector3d& axis) {
  const Eigen::Matrix3d along = axis.isZero(0.0)
                                    ? Eigen::Matrix3d::Identity().eval()
                                    : (axis * axis.transpose() / axis.squaredNorm()).eval();
  return kTurn * kTurn * along + kTurnAcross * kTurnAcross * Eigen::Matrix3d::Identity();
}

}  // namespace crepes
