/// Refuses inertial samples that contradict their neighbors in time.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "estimator/core/imu_history.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/relative/imu_blow.hpp"
#include "estimator/relative/imu_innovation.hpp"
#include "estimator/relative/imu_watch.hpp"

namespace crepes {

/// Compares each sample with its prediction from the two before. A sample with an unlikely
/// innovation waits for its successors, and nothing is believed meanwhile: ImuHistory extrapolates
/// with the noise that belongs to it. If the successors return to the prediction, the sample was a
/// spike. If they agree with the sample, the motion has changed, and all are believed, one sample
/// late. A false alarm costs no more than that. A spike of the accelerometer looks like a blow, as
/// when a robot lands or hits a wall. It is refused, but `blow_mps` tells what it would have been.
/// A blow turns the robot, too. So the rate of a refused sample is kept if a robot reaches it:
/// damaged by as little, it turns the estimate by 0.02 rad, and `KeptRate` tells by how much.
///
/// A change that no robot makes within a sample (unit, swapped axes) is not believed when it stays.
/// Samples are believed again when they return, or when a fifth of a second of them is plausible.
/// Where their gravity contradicts the samples before, those that have lasted longer are believed,
/// and after five seconds the new ones in any case.
class ImuGuard {
 public:
  /// The samples that are believed from now on, in order of their stamps; valid until the next
  /// call. A sample older than the newest is passed on, see `agrees`.
  [[nodiscard]] std::span<const ImuSample> accept(const ImuSample& sample);

  /// True if the sample does not contradict the mean rates about its stamp.
  [[nodiscard]] bool agrees(const ImuSample& sample, const ImuMean& mean) const;

  /// The velocity that refused forces would have caused before this believed sample, body axes.
  [[nodiscard]] Eigen::Vector3d blow_mps(const ImuSample& believed) const {
    return blow_.velocity_mps(believed);
  }
  /// The rates that are kept between this believed sample and the one before, in order of their
  /// stamps; valid until the next call of `accept`.
  [[nodiscard]] std::span<const KeptRate> rates_before(const ImuSample& believed) const {
    return blow_.rates_before(believed);
  }
  /// The latest samples that were refused as spikes, in order of their stamps.
  [[nodiscard]] std::span<const ImuSample> spikes() const { return {spikes_.data(), spike_count_}; }

  /// True if the last sample was saturated. The ones before it were as wrong, and believed.
  [[nodiscard]] bool is_saturated() const { return watch_.is_saturated(); }
  /// By reason.
  [[nodiscard]] const ImuFaultCounts& refused() const { return refused_; }

 private:
  static constexpr std::size_t kMostHeld = 20;  ///< the samples that are judged after a jump
  static constexpr std::size_t kMostSpikes = 16;

  void count(ImuFault fault, std::size_t samples = 1) {
    refused_.at(static_cast<std::size_t>(fault)) += samples;
  }
  [[nodiscard]] bool is_late(const ImuSample& sample) const;
  void weigh(const ImuSample& sample);
  [[nodiscard]] bool shows_gravity() const;
  [[nodiscard]] PerSensor limit() const;
  [[nodiscard]] PerSensor largest_change() const;
  [[nodiscard]] PerSensor excess(const ImuSample& sample, const ImuReference& reference) const;
  [[nodiscard]] ImuReference reference_of_held(std::size_t i) const;
  /// The sample before the held one `i`; the last believed one before the first of them.
  [[nodiscard]] const ImuSample& before_held(std::size_t i) const;
  /// The last sample that was held or believed; null before the first.
  [[nodiscard]] const ImuSample* newest() const;

  void compare(const ImuSample& sample);
  void judge(const ImuSample& sample);
  void add_innovation(const PerSensor& innovation);
  void believe(const ImuSample& sample);
  void refuse_spike(const ImuSample& spike);
  void believe_held(std::size_t from);
  void drop_held(ImuFault fault);
  void clear_held();
  void hold(const ImuSample& sample);
  void turn_force(const ImuSample& sample, Timestamp since);
  void correct_force(const ImuSample& sample);
  void follow_force(const ImuSample& sample, const ImuSample& last);
  void restart_from_held();
  [[nodiscard]] bool is_shock(const PerSensor& back, const PerSensor& on) const;
  [[nodiscard]] std::size_t first_of_level() const;
  [[nodiscard]] bool is_reachable(const ImuSample& sample) const;
  [[nodiscard]] bool are_held_reachable() const;
  [[nodiscard]] bool held_are_plausible() const;

  ImuWatch watch_;
  Timestamp weighed_ = kNever;  ///< the latest sample whose force is in the mean
  double mean_force_ = 0.0;     ///< of the last seconds [m/s^2]
  std::optional<ImuReference> reference_;
  InnovationScale gyro_;
  InnovationScale accel_;
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero();  ///< smoothed specific force, body axes
  Timestamp since_ = kNever;  ///< the first of the samples whose forces agree
  ImuBlow blow_;
  bool has_refused_ = false;  ///< since the last sample that was believed
  bool has_jumped_ = false;   ///< the held samples must be plausible to be believed
  bool gyro_has_jumped_ = false;
  bool accel_has_jumped_ = false;

  std::array<ImuSample, kMostHeld> held_{};
  std::size_t held_count_ = 0;
  std::array<ImuSample, kMostSpikes> spikes_{};
  std::size_t spike_count_ = 0;
  std::array<ImuSample, kMostHeld + 1> believed_{};
  std::size_t believed_count_ = 0;
  ImuFaultCounts refused_{};
};

}  // namespace crepes
