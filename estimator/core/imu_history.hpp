/// The recent IMU samples of one robot, as signals in continuous time.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>

#include "estimator/core/measurements.hpp"
#include "estimator/core/signal_model.hpp"
#include "estimator/core/vibration_level.hpp"

namespace crepes {

/// Mean rate and specific force over an interval, body axes.
struct ImuMean {
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();
  double extrapolated = 0.0;  ///< share of the interval, 0..1, that no sample covers
  /// Mean square of the time to the nearest sample where none covers, at most kMaxHold^2 [s^2].
  double extrapolation_time2_s2 = 0.0;
  /// White noise measured in the samples, with vibration.
  double gyro_noise_density = 0.0;   ///< [rad/s/sqrt(Hz)]
  double accel_noise_density = 0.0;  ///< [m/s^2/sqrt(Hz)]
  /// Errors of the extrapolation, if there is any, as the density of a random walk.
  double gyro_innovation_density = 0.0;   ///< [rad/s/sqrt(s)]
  double accel_innovation_density = 0.0;  ///< [m/s^2/sqrt(s)]
  /// Variance of the velocity after the interval by forces that were refused, but may be real; body
  /// axes. Those of parts add up to that of the whole.
  Eigen::Vector3d blow_variance_m2ps2 = Eigen::Vector3d::Zero();
  /// Variance of the attitude after the interval by rates that are kept, but may be damaged; body
  /// axes. Those of parts add up to that of the whole.
  Eigen::Vector3d turn_variance_rad2 = Eigen::Vector3d::Zero();
  /// Variance by which each axis of the accelerometer's bias may have changed, because the airframe
  /// began to vibrate or ceased to. Those of parts add up to that of the whole.
  double bias_variance_m2ps4 = 0.0;
};

/// Finite, and within 100 rad/s and 1000 m/s^2 an axis.
[[nodiscard]] bool is_plausible(const ImuSample& sample);

/// Bounded: keeps the newest `kCapacity` samples in order of their stamps. A sample is the mean
/// since the one before, stamped at its end, as from an IMU that integrates internally. So sums
/// over samples are exact. Beyond the newest sample a SignalModel predicts the signals, or the
/// sample is held if there was a gap shortly before. Before the oldest, the next one is held. Gaps
/// longer than `kMaxGap` are bridged by a straight line, whose error is that of a random walk
/// between two known ends (a Brownian bridge). All this is extrapolation.
class ImuHistory {
 public:
  /// A second of the fastest IMU (`imu.update_rate`): a filter may be that far behind.
  static constexpr std::size_t kCapacity = 1024;
  static constexpr Duration kMaxGap = std::chrono::milliseconds{50};
  static constexpr Duration kMaxHold = std::chrono::milliseconds{500};

  /// False, and nothing changes, if the sample is implausible, a duplicate, or older than all kept.
  /// `blow_mps` is the velocity, in body axes, by forces that were refused since the sample before,
  /// `turn_rad` the turn since then that is none if the rate is damaged.
  bool push(const ImuSample& sample, const Eigen::Vector3d& blow_mps = Eigen::Vector3d::Zero(),
            const Eigen::Vector3d& turn_rad = Eigen::Vector3d::Zero());

  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Counted from the oldest.
  [[nodiscard]] const ImuSample& operator[](std::size_t i) const { return kept(i).sample; }
  [[nodiscard]] const ImuSample& newest() const { return (*this)[size_ - 1]; }

  /// Mean over [from, to], from < to; there must be a sample.
  [[nodiscard]] ImuMean mean(Timestamp from, Timestamp to) const;

  /// The part of the time between two instants, in either order, that no sample covers. There must
  /// be a sample.
  [[nodiscard]] Duration extrapolated(Timestamp from, Timestamp to) const;

  /// The body's rotation R_from_to between two instants, in either order, by the gyroscope alone.
  /// There must be a sample.
  [[nodiscard]] Eigen::Quaterniond rotation(Timestamp from, Timestamp to) const;

 private:
  struct Kept {
    ImuSample sample;
    Eigen::Vector3d blow_mps = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();
    double bias_variance_m2ps4 = 0.0;
  };

  Kept& slot(std::size_t i) { return kept_[(first_ + i) % kCapacity]; }
  [[nodiscard]] const Kept& kept(std::size_t i) const { return kept_[(first_ + i) % kCapacity]; }
  [[nodiscard]] std::size_t first_after(Timestamp t) const;
  /// The newest samples, if they are equally spaced.
  template <class Samples>
  struct Recent {
    Samples gyro;
    Samples accel;
    double period_s = 0.0;
  };
  template <class Samples>
  [[nodiscard]] std::optional<Recent<Samples>> recent() const;
  void observe_motion();
  /// Strides from the newest sample to the middle of an interval beyond it.
  [[nodiscard]] double strides_to(Timestamp from, Timestamp to, double period_s) const;
  void add_predicted(Timestamp from, Timestamp to, ImuMean& sum) const;
  void add_held(const ImuSample& sample, double dt, ImuMean& sum) const;
  /// Of the gap before a sample, of which the interval is a part.
  void add_bridge(std::size_t after, Timestamp from, Timestamp to, ImuMean& sum) const;

  std::array<Kept, kCapacity> kept_{};
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  SignalModel gyro_;
  SignalModel accel_;
  VibrationLevel vibration_;
};

}  // namespace crepes
