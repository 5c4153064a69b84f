/// Noise and linear prediction of one inertial signal, estimated from its samples.
#pragma once

#include <Eigen/Core>

namespace crepes {

/// Needs equally spaced samples; its memory is about a second. The second differences of successive
/// samples, in which motion cancels, give the white noise with the vibration of the airframe. A
/// linear prediction from the last two changes (Makhoul 1975) gives the next change: a slow swing
/// continues, a vibration returns to the mean.
class SignalModel {
 public:
  /// Samples of one change: about the delay of a peer's samples.
  static constexpr int kStride = 3;
  /// Successive samples, the newest first.
  using Window = Eigen::Matrix<double, 3, 3 * kStride + 1>;

  /// Updates the model with samples `period_s` apart.
  void observe(const Window& window, double period_s);

  /// The change from the newest sample to kStride samples later.
  [[nodiscard]] Eigen::Vector3d next_change(const Window& window) const;

  /// White noise, in the unit of the signal per sqrt(Hz).
  [[nodiscard]] double noise_density() const;
  /// Error of the prediction as a random walk, in the unit of the signal per sqrt(s).
  [[nodiscard]] double innovation_density() const;

 private:
  double noise_density2_ = 0.0;
  double innovation_density2_ = 0.0;
  // Smoothed products of the last two changes with each other and with the next one.
  Eigen::Matrix2d changes_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d with_next_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d weights_ = Eigen::Vector2d::Zero();
};

}  // namespace crepes
