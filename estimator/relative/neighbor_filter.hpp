/// The tight filter of one neighbor: an error-state Kalman filter of single measurements.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "estimator/core/imu_history.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/relative/error_state.hpp"
#include "estimator/relative/kalman_update.hpp"
#include "estimator/relative/propagation.hpp"
#include "estimator/relative/raw_pose.hpp"

namespace crepes {

/// Priors of the states, one sigma.
struct Priors {
  double speed_mps = 5.0;  ///< of the neighbor relative to us, per axis
  double gyro_bias_radps = 0.0;
  double accel_bias_mps2 = 0.0;
  double gyro_scale = 0.0;   ///< of each entry
  double accel_scale = 0.0;  ///< of each entry
  double range_bias_m = 0.0;
  double misalignment_rad = 0.0;
  double lens_rad = 0.0;  ///< of a camera's directions, besides a rotation

  [[nodiscard]] bool operator==(const Priors&) const = default;
};

/// The direction of an LED ring in the body of the robot whose camera sees it.
struct DirectionReading {
  Eigen::Vector3d u = Eigen::Vector3d::UnitX();
  Eigen::Vector3d camera = Eigen::Vector3d::Zero();
  double sigma_rad = 0.0;
};

/// A range and its errors, one sigma each.
struct RangeReading {
  double range_m = 0.0;
  double sigma_m = 0.0;   ///< its noise
  double shared_m = 0.0;  ///< what the ranges about it have in common, beside the pair's bias
};

/// The distance of a camera, in the body of its robot, to an LED ring, by the ring's size.
struct RingReading {
  Eigen::Vector3d camera = Eigen::Vector3d::Zero();
  double distance_m = 0.0;
  double sigma_m = 0.0;  ///< without kRingScaleSigma
};

/// ErrorState::kSize error states: relative motion, both IMUs' biases and scales, the pair's
/// range bias and both cameras' misalignment. Advances forward only; corrections apply at
/// `stamp()`.
class NeighborFilter {
 public:
  /// The errors of `first` are correlated with the calibration states; the speed is unknown.
  NeighborFilter(Timestamp stamp, const RawPose& first, const ProcessNoise& noise,
                 const Priors& priors);
  /// The errors of the pose are independent; the speed is unknown. The neighbor has not seen us.
  NeighborFilter(Timestamp stamp, const GaussianPose& T_B_N, const ProcessNoise& noise,
                 const Priors& priors);
  /// From the pose graph, which includes the speed.
  NeighborFilter(Timestamp stamp, const GraphPose& first, const ProcessNoise& noise,
                 const Priors& priors);

  /// Applies to later propagation.
  void set_noise(const ProcessNoise& noise) { noise_ = noise; }

  [[nodiscard]] Timestamp stamp() const { return stamp_; }
  /// Propagates the state to `to` by the IMUs of both robots.
  void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);

  /// Our camera on the neighbor's ring.
  Fusion fuse_bearing(const DirectionReading& z, const Eigen::Vector3d& p_N_M, double gate_nis);
  /// The neighbor's camera on our ring.
  Fusion fuse_peer_bearing(const DirectionReading& z, const Eigen::Vector3d& p_B_M,
                           double gate_nis);
  /// Corrects the state by the distance between two antennas.
  Fusion fuse_range(const RangeReading& z, const Eigen::Vector3d& p_B_U,
                    const Eigen::Vector3d& p_N_Q, double gate_nis);
  /// Corrects the state by the distance of our camera to the neighbor's ring. Antenna delays are
  /// not in it.
  Fusion fuse_ring_distance(const RingReading& z, const Eigen::Vector3d& p_N_M, double gate_nis);

  /// A pose whose errors may be correlated with this filter and with earlier such poses: covariance
  /// intersection (Julier and Uhlmann 1997).
  Fusion fuse_correlated_pose(const GaussianPose& T_B_N, double gate_nis);

  /// After wrong ranges: adds `sigma_m` to the uncertainty of the distance and resets the
  /// covariance of speed and calibration to the priors.
  void reset_distance(double sigma_m, const Priors& priors);

  /// Bearings of this kind come from another camera from now on, with another misalignment.
  void reset_misalignment(MeasurementKind kind, double misalignment_rad);

  /// From now on, the neighbor's turn about this axis (N's axes) is a considered parameter (Schmidt
  /// 1966): nothing corrects it, and its uncertainty counts.
  void hold_heading(const Eigen::Vector3d& up_N) { held_ = up_N.normalized(); }
  /// From now on it is estimated again.
  void release_heading() { held_.reset(); }

  /// One Gaussian of a split, and its weight.
  struct Part;
  /// Splits the Gaussian along its most uncertain attitude axis into parts that are narrow enough
  /// for one linearization. Their weighted sum approximates the whole.
  [[nodiscard]] std::vector<Part> split() const;

  [[nodiscard]] const RelativeMotion& motion() const { return state_.motion; }
  [[nodiscard]] const NominalState& state() const { return state_; }
  [[nodiscard]] const ErrorState::Covariance& covariance() const { return P_; }
  /// Of T_B_N, in GaussianPose's convention.
  [[nodiscard]] Matrix6d pose_covariance() const;

 private:
  /// By a bearing; by nothing where the model is singular.
  template <class Innovation>
  Fusion correct(std::optional<Innovation> z, double gate_nis);
  /// Whether ranges that were used hold the distance.
  [[nodiscard]] bool has_ranges() const;
  /// Whether our camera has not seen the neighbor of late.
  [[nodiscard]] bool is_blind() const;
  /// What goes with a turn about the held axis, and its variance.
  struct Held {
    ErrorState::Vector by_turn = ErrorState::Vector::Zero();
    double variance = 0.0;
  };
  [[nodiscard]] std::optional<Held> held() const;
  /// Takes back what an update since `before` tells of the held turn.
  void hold(const std::optional<Held>& before, ErrorState::Vector& correction);
  /// Corrects the state, after P.
  void apply(const ErrorState::Vector& correction);

  Timestamp stamp_;
  NominalState state_;
  ErrorState::Covariance P_;
  ProcessNoise noise_;
  /// The newest, oldest first.
  std::array<Timestamp, 3> ranges_used_{Timestamp::min(), Timestamp::min(), Timestamp::min()};
  std::optional<Eigen::Vector3d> held_;  ///< axis of the turn that is not estimated, N's axes
  Timestamp seen_ = kNever;              ///< when a bearing of our camera was last used
  bool was_seen_by_ = true;              ///< whether the neighbor has ever seen us
};

/// One Gaussian of a split, and its weight.
struct NeighborFilter::Part {
  NeighborFilter filter;
  double log_weight = 0.0;  ///< up to a constant
};

}  // namespace crepes
