/// A body between two knots, carried by its IMU's samples, for numbers that carry derivatives.
#pragma once

#include <span>
#include <vector>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/calibration/camera/camera_state.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// The parameters' indices: the knot in its error order, then the matrices of gyroscope (by rows)
/// and accelerometer (upper triangle by rows), then the time within a step.
namespace interval_columns {
inline constexpr int kMatrices = ArrowSystem::kState;
inline constexpr int kSize = kMatrices + 15;
inline constexpr int kTime = kSize;
}  // namespace interval_columns

/// The samples of an interval, each the mean over the time that ends at its stamp. The interval
/// begins at the stamp of the first; `after` follows the last.
struct ImuStretch {
  std::span<const ImuSample> samples;
  const ImuSample* after = nullptr;
};

/// Attitude and position at an instant.
template <class T>
struct BodyPlace {
  Matrix3<T> R_W_B;
  Vector3<T> p_W;
};

/// Between knots the samples are believed to the letter; their noise enters from knot to knot.
template <class T>
class BodyInterval {
 public:
  BodyInterval(const CameraConstants& constants, const CameraKnot& knot, const ImuStretch& imu);

  /// After `tau` of step `i`, which ends at the stamp of sample i + 1.
  [[nodiscard]] BodyPlace<T> at(std::size_t i, const T& tau) const {
    const Step& step = steps_[i];
    const Vector3<T> phi = step.imu.angle(tau);
    return {turned(step.start.R_W_B, phi),
            step.start.p_W + step.start.v_W * tau + step.a_W * (0.5 * tau * tau)};
  }
  [[nodiscard]] const Motion<T>& end() const { return motion_; }
  [[nodiscard]] const Vector3<T>& gyro_bias() const { return gyro_bias_; }
  [[nodiscard]] const Vector3<T>& accel_bias() const { return accel_bias_; }

 private:
  struct Step {
    Motion<T> start;
    InertialStep<T> imu;
    Vector3<T> a_W;
  };

  /// R Exp(phi)
  [[nodiscard]] static Matrix3<T> turned(const Matrix3<T>& R, const Vector3<T>& phi) {
    Matrix3<T> next;
    for (int row = 0; row < 3; ++row) {
      const Vector3<T> axis = R.row(row).transpose();
      next.row(row) = rotated<T>(-phi, axis).transpose();
    }
    return next;
  }
  void seed_matrices(const CameraConstants& constants);
  void walk(const ImuStretch& imu);

  std::vector<Step> steps_;
  Motion<T> motion_;
  Vector3<T> gyro_bias_;
  Vector3<T> accel_bias_;
  Matrix3<T> M_gyro_;
  Matrix3<T> M_accel_;
};

template <class T>
BodyInterval<T>::BodyInterval(const CameraConstants& constants, const CameraKnot& knot,
                              const ImuStretch& imu)
    : motion_{seeded_rotation<T>(knot.q_W_B, 0), seeded<T>(knot.v_W, 3), seeded<T>(knot.p_W, 6)},
      gyro_bias_(seeded<T>(knot.gyro_bias, 9)),
      accel_bias_(seeded<T>(knot.accel_bias, 12)) {
  seed_matrices(constants);
  walk(imu);
}

template <class T>
void BodyInterval<T>::seed_matrices(const CameraConstants& constants) {
  int next = interval_columns::kMatrices;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) M_gyro_(i, j) = seeded<T>(constants.M_gyro(i, j), next++);
  M_accel_.setConstant(T(0.0));
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) M_accel_(i, j) = seeded<T>(constants.M_accel(i, j), next++);
}

template <class T>
void BodyInterval<T>::walk(const ImuStretch& imu) {
  const auto rate_of = [&](const ImuSample& sample) -> Vector3<T> {
    return M_gyro_ * (sample.gyro_radps.cast<T>() - gyro_bias_);
  };
  const std::span<const ImuSample> samples = imu.samples;
  steps_.reserve(samples.size());
  Vector3<T> before = rate_of(samples[0]);
  Vector3<T> now = rate_of(samples[1]);
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double dt = to_seconds(samples[i].stamp - samples[i - 1].stamp);
    const Vector3<T> after = rate_of(i + 1 < samples.size() ? samples[i + 1] : *imu.after);
    const InertialStep<T> step{.rate = now,
                               .rate_change = (after - before) * T(0.5 / dt),
                               .accel = M_accel_ * (samples[i].accel_mps2.cast<T>() - accel_bias_),
                               .dt = dt};
    const Vector3<T> a_W = step.world_acceleration(motion_.R_W_B, kNominalGravityMps2);
    steps_.push_back({motion_, step, a_W});
    motion_.p_W += motion_.v_W * T(dt) + a_W * T(0.5 * dt * dt);
    motion_.v_W += a_W * T(dt);
    motion_.R_W_B = turned(motion_.R_W_B, step.angle(T(dt)));
    before = now;
    now = after;
  }
}

}  // namespace crepes
