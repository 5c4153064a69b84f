/// What the samples of one inertial signal show of it: its noise, and how it goes on.
#pragma once

#include <Eigen/Core>

namespace crepes {

/// Learns from samples at an even pace, forgets over seconds. White noise is read off second
/// differences of successive samples, in which motion cancels: no data sheet knows how an airframe
/// vibrates. How the signal goes on is a linear prediction from its last two changes (Makhoul
/// 1975): a hand's swing goes on, a vibration's next change goes back to the mean.
class SignalModel {
 public:
  /// Samples to a change: about as long as a peer's samples are late.
  static constexpr int kStride = 3;
  /// Of successive samples, the newest first.
  using Window = Eigen::Matrix<double, 3, 3 * kStride + 1>;

  /// Of samples `period_s` apart.
  void observe(const Window& window, double period_s);

  /// The change from the newest sample to kStride samples later.
  [[nodiscard]] Eigen::Vector3d next_change(const Window& window) const;

  /// White noise, of the signal's unit by sqrt(Hz).
  [[nodiscard]] double density() const;
  /// How fast the signal leaves its prediction, as a random walk of this density: by sqrt(s).
  [[nodiscard]] double surprise() const;

 private:
  double density2_ = 0.0;
  double surprise2_ = 0.0;
  // Smoothed products of the last two changes, with each other and with the next one.
  Eigen::Matrix2d changes_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d with_next_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d weights_ = Eigen::Vector2d::Zero();
};

}  // namespace crepes
