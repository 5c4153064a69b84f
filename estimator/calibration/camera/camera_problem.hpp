/// The batch problem of a camera calibration: boards at rest, a body that an IMU carries along.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/camera/camera_state.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {

/// A board's spot in one frame.
struct BoardSighting {
  Timestamp stamp{};      ///< the camera's
  std::size_t board = 0;  ///< index of the board
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();
};

/// Whether there are inertial samples on both sides. `imu` is ordered by stamp and not empty.
[[nodiscard]] inline bool is_sampled(Timestamp t, std::span<const ImuSample> imu) {
  return t >= imu.front().stamp && t <= imu.back().stamp;
}

/// One-sigma priors of what a recording may not show. Units as in `CameraConstants`.
struct CameraPriors {
  LensVector lens = (LensVector() << 0.5, 0.2, 200.0, 200.0, 100.0, 100.0).finished();
  double rotation_rad = 1.0;
  double position_m = 0.05;
  double shift_s = 0.05;
  double imu_matrix = 0.005;
  double gyro_bias_radps = 0.05;
  double accel_bias_mps2 = 0.3;
  double board_m = 10.0;
  double layout_scale = 0.03;  ///< a pitch by ruler, or one mistaken for that of another target
};

/// A sighting's residual [px], and whether the lens could show it at all.
struct SightingResidual {
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();
  bool is_valid = false;
};

/// Knots every tenth of a second. Between them the body moves as the IMU's samples say: white noise
/// enters from knot to knot (preintegration: Forster et al. 2017), nothing within. A sample is the
/// mean over the interval that ends at its stamp; within it the rate changes linearly.
class CameraProblem {
 public:
  /// `imu`, ordered by stamp, outlives the problem. `sightings` are ordered by stamp; those of
  /// times without samples are left out.
  CameraProblem(std::span<const ImuSample> imu, std::vector<BoardSighting> sightings,
                const ImuNoise& noise, CameraPriors priors);

  [[nodiscard]] std::size_t knots() const { return first_sample_.size(); }
  [[nodiscard]] std::span<const BoardSighting> sightings() const { return sightings_; }
  /// The sample after which a knot stands; its time is the sample's stamp.
  [[nodiscard]] std::size_t sample_of(std::size_t knot) const { return first_sample_[knot]; }

  /// What sightings weigh, one each: 1, or less for outliers; 0 leaves one out.
  void set_weights(std::vector<double> weights) { weights_ = std::move(weights); }
  void set_sigma_px(double sigma_px) { sigma_px_ = sigma_px; }
  [[nodiscard]] double sigma_px() const { return sigma_px_; }

  [[nodiscard]] double cost(const CameraState& state, const CameraState& prior) const;
  [[nodiscard]] ArrowSystem linearize(const CameraState& state, const CameraState& prior) const;
  [[nodiscard]] std::vector<SightingResidual> residuals(const CameraState& state) const;

 private:
  template <class T, class Visitor>
  void walk(const CameraState& state, std::size_t knot, Visitor& visitor) const;
  template <class Visitor>
  void visit_priors(const CameraState& state, const CameraState& prior, Visitor& visitor) const;
  [[nodiscard]] double seconds(Timestamp t) const { return to_seconds(t - imu_[0].stamp); }

  std::span<const ImuSample> imu_;
  std::vector<BoardSighting> sightings_;
  std::vector<double> weights_;
  std::vector<std::size_t> first_sample_;
  ImuNoise noise_;
  CameraPriors priors_;
  double sigma_px_ = 1.0;
};

}  // namespace crepes
