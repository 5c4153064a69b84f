/// Noise and linear prediction of one inertial signal, estimated from its samples.
#pragma once

#include <Eigen/Core>
#include <array>

namespace crepes {

/// Needs equally spaced samples; its memory is about a second. The second differences of successive
/// samples, in which motion cancels, give the white noise with the vibration of the airframe. A
/// linear prediction from the last changes (Makhoul 1975) gives the next ones, each horizon by
/// weights of its own: a slow swing continues and returns, a vibration returns to the mean. The
/// signal is assumed to stay near what it was within the memory: of a shock after a quiet time,
/// weights say anything.
class SignalModel {
 public:
  /// Samples of one change.
  static constexpr int kStride = 3;
  static constexpr int kChanges = 4;   ///< that a prediction uses
  static constexpr int kHorizons = 7;  ///< strides ahead: the delay of samples if some are lost
  /// Successive samples, the newest first: those that a prediction uses.
  using Window = Eigen::Matrix<double, 3, kStride * kChanges + 1>;
  /// Those that the model learns from.
  using Past = Eigen::Matrix<double, 3, kStride*(kChanges + kHorizons) + 1>;

  /// White noise in the newest three samples alone, `period_s` apart, as a density squared.
  [[nodiscard]] static double newest_noise_density2(const Past& past, double period_s);
  /// Updates the model with samples `period_s` apart.
  void observe(const Past& past, double period_s);

  /// The change from the newest sample to so many strides later, at most kHorizons.
  [[nodiscard]] Eigen::Vector3d change_after(double strides, const Window& window) const;

  /// White noise, in the unit of the signal per sqrt(Hz).
  [[nodiscard]] double noise_density() const;
  /// Error of the prediction after so many strides, as a random walk, in the unit of the signal per
  /// sqrt(s). Beyond the last horizon, what is predicted for it is held.
  [[nodiscard]] double innovation_density(double strides) const;
  /// Error of a sample that is held instead, likewise.
  [[nodiscard]] double hold_density() const;

 private:
  using Weights = Eigen::Matrix<double, kChanges, 1>;

  /// Of the prediction a fixed time ahead.
  struct Horizon {
    // Smoothed products of the changes with each other and with the one that is predicted.
    Eigen::Matrix<double, kChanges, kChanges> changes =
        Eigen::Matrix<double, kChanges, kChanges>::Zero();
    Weights with_next = Weights::Zero();
    Weights weights = Weights::Zero();
    double innovation_density2 = 0.0;
  };

  double noise_density2_ = 0.0;
  double hold_density2_ = 0.0;  // over the longest horizon
  // The range of the signal, an axis each, which shrinks towards the newest sample.
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_ = Eigen::Vector3d::Zero();
  std::array<Horizon, kHorizons> horizons_{};
};

}  // namespace crepes
