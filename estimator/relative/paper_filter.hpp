/// The paper's error-state Kalman filter (III-D), equation by equation.
#pragma once

#include <Eigen/Core>

#include "estimator/core/imu_history.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/relative/error_state.hpp"
#include "estimator/relative/kalman_update.hpp"
#include "estimator/relative/propagation.hpp"
#include "estimator/relative/raw_pose.hpp"

namespace crepes {

/// The paper's two-sided error: q_t = dq_B* q dq_A, p_t = R^T{theta_B} (p + dp), likewise v. (The
/// paper's A, the observed robot, is N everywhere else.) Twelve numbers for nine degrees of
/// freedom: a common turn of both frames changes nothing that can be measured, so only the pose's
/// own covariance is ever published.
struct PaperError {
  /// The first row of each part of the error.
  enum Index : int { kP = 0, kV = 3, kThetaA = 6, kThetaB = 9, kSize = 12 };
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Covariance = Eigen::Matrix<double, kSize, kSize>;
};

/// x_t = x (+) dx, paper eq. 8.
[[nodiscard]] RelativeMotion paper_plus(const RelativeMotion& x, const PaperError::Vector& dx);

/// Eq. 9: p, v and q over a step, exactly as printed.
[[nodiscard]] RelativeMotion paper_propagated(const RelativeMotion& x, const BodyRates& a_B,
                                              const BodyRates& a_A, double dt);

/// F_x of eq. 10.
[[nodiscard]] PaperError::Covariance paper_transition(const RelativeMotion& x,
                                                      const BodyRates& rates_B,
                                                      const BodyRates& rates_A, double dt);

/// F_i of eq. 10; columns a_nA, w_nA, a_nB, w_nB.
[[nodiscard]] PaperError::Covariance paper_noise_input(const RelativeMotion& x,
                                                       const BodyRates& rates_B, double dt);

/// Residual and H of eq. 16. The paper subtracts quaternions; the residual here is the rotation
/// Log(q^-1 q_z), whose error is what the right perturbation of V describes.
[[nodiscard]] Innovation<9, PaperError::kSize> paper_innovation(const RelativeMotion& x,
                                                                const RawPose& z);

/// G of eq. 20, at the correction that was injected.
[[nodiscard]] PaperError::Covariance paper_reset(const PaperError::Vector& dx_hat);

/// One neighbor under `--profile paper`.
class PaperFilter {
 public:
  PaperFilter(Timestamp stamp, const RawPose& first, const ProcessNoise& noise);
  /// From the pose graph, for a neighbor that was never seen directly.
  PaperFilter(Timestamp stamp, const GraphPose& first, const ProcessNoise& noise);

  /// Of both robots' motion from now on.
  void set_noise(const ProcessNoise& noise) { noise_ = noise; }

  [[nodiscard]] Timestamp stamp() const { return stamp_; }
  /// Eq. 9 to 13, in steps of at most 10 ms. `to` may not lie before `stamp()`.
  void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);
  /// Eq. 16 to 20.
  Fusion fuse(const RawPose& z, double gate_nis);
  /// The graph's pose, as a measurement of q and p alone.
  Fusion fuse(const GaussianPose& T_B_N, double gate_nis);

  [[nodiscard]] const RelativeMotion& motion() const { return x_; }
  /// Of T_B_N, in GaussianPose's convention.
  [[nodiscard]] Matrix6d pose_covariance() const;

 private:
  template <int M>
  Fusion correct(const Innovation<M, PaperError::kSize>& z, double gate_nis);

  Timestamp stamp_;
  RelativeMotion x_;
  PaperError::Covariance P_ = PaperError::Covariance::Zero();
  ProcessNoise noise_;
};

}  // namespace crepes
