/// The tight filter of one neighbor: every measurement by itself, at its own time.
#pragma once

#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/relative/error_state.hpp"
#include "estimator/relative/imu_history.hpp"
#include "estimator/relative/kalman_update.hpp"
#include "estimator/relative/propagation.hpp"
#include "estimator/relative/raw_pose.hpp"

namespace crepes {

/// What is believed of sensors before they speak, one sigma.
struct Priors {
  double speed_mps = 2.0;
  double gyro_bias_radps = 0.0;
  double accel_bias_mps2 = 0.0;
  double gyro_scale = 0.0;   ///< of each entry
  double accel_scale = 0.0;  ///< of each entry
  double range_bias_m = 0.0;
  double misalignment_rad = 0.0;
};

/// A camera's word on where a ring is, in the seeing robot's body.
struct DirectionReading {
  Eigen::Vector3d u = Eigen::Vector3d::UnitX();
  Eigen::Vector3d camera = Eigen::Vector3d::Zero();
  double sigma_rad = 0.0;
};

struct RangeReading {
  double range_m = 0.0;
  double sigma_m = 0.0;
};

/// ErrorState::kSize error states: relative motion, both IMUs' biases and scales, the pair's
/// range bias and both cameras' misalignment. Moves forward only; corrections apply at `stamp()`.
class NeighborFilter {
 public:
  /// `first` shares its errors of calibration with all that follows; the speed is unknown.
  NeighborFilter(Timestamp stamp, const RawPose& first, const ProcessNoise& noise,
                 const Priors& priors);
  /// With errors of its own; the speed is unknown.
  NeighborFilter(Timestamp stamp, const GaussianPose& T_B_N, const ProcessNoise& noise,
                 const Priors& priors);
  /// From the pose graph: the speed is known as well as that of the robots between.
  NeighborFilter(Timestamp stamp, const GraphPose& first, const ProcessNoise& noise,
                 const Priors& priors);

  /// Of both robots' motion and sensors from now on.
  void set_noise(const ProcessNoise& noise) { noise_ = noise; }

  [[nodiscard]] Timestamp stamp() const { return stamp_; }
  void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);

  /// Our camera on the neighbor's ring.
  Fusion fuse_bearing(const DirectionReading& z, const Eigen::Vector3d& p_N_M, double gate_nis);
  /// The neighbor's camera on our ring.
  Fusion fuse_peer_bearing(const DirectionReading& z, const Eigen::Vector3d& p_B_M,
                           double gate_nis);
  Fusion fuse_range(const RangeReading& z, const Eigen::Vector3d& p_B_U,
                    const Eigen::Vector3d& p_N_Q, double gate_nis);
  /// A pose whose errors may go together with this filter's, and with those of such poses before:
  /// covariance intersection (Julier and Uhlmann 1997).
  Fusion fuse_correlated_pose(const GaussianPose& T_B_N, double gate_nis);

  /// The distance is known no better than `sigma_m` any more, and the speed and what was learned of
  /// the sensors no better than at the start: wrong ranges have led them astray.
  void forget_distance(double sigma_m, const Priors& priors);

  /// Bearings of this kind come from another camera from now on, misaligned in its own way.
  void change_camera(MeasurementKind kind, double misalignment_rad);

  struct Part;
  /// As Gaussians that are narrow enough for one linearization each, the attitude cut across its
  /// most uncertain axis; their weighted sum is about the whole.
  [[nodiscard]] std::vector<Part> split() const;

  [[nodiscard]] const RelativeMotion& motion() const { return state_.motion; }
  [[nodiscard]] const NominalState& state() const { return state_; }
  [[nodiscard]] ErrorState::Covariance covariance() const;
  /// Of T_B_N, in GaussianPose's convention.
  [[nodiscard]] Matrix6d pose_covariance() const;

 private:
  /// `linearize` gives the innovation at a state, or nothing where it says nothing.
  template <class Linearize>
  Fusion correct(const Linearize& linearize, double gate_nis);

  Timestamp stamp_;
  NominalState state_;
  ErrorState::Covariance P_ = ErrorState::Covariance::Zero();
  ProcessNoise noise_;
};

struct NeighborFilter::Part {
  NeighborFilter filter;
  double log_weight = 0.0;  ///< up to a constant
};

}  // namespace crepes
