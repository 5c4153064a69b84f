/// What inertial samples that were refused may have been: a blow.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "estimator/core/measurements.hpp"

namespace crepes {

/// The rate of a refused sample, with the force of the believed one before it.
struct KeptRate {
  ImuSample sample;
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  ///< by it, if it is damaged; body axes
};

/// Collects the samples that are refused after a believed one. The next believed one ends the blow.
/// Samples that are refused for longer than a blow lasts are none.
class ImuBlow {
 public:
  static constexpr std::size_t kLongest = 10;  ///< samples

  /// Adds a refused sample; `last` is the believed one before it.
  void add(const ImuSample& refused, const ImuSample& last);
  /// The blow ends with the believed sample `after`. A rate is kept if it differs by at most
  /// `reachable_radps` from the one before it.
  void end(const ImuSample& after, const ImuSample& last, double reachable_radps);
  /// Nothing was refused.
  void forget();

  /// The velocity that the forces would have caused before this believed sample, body axes.
  [[nodiscard]] Eigen::Vector3d velocity_mps(const ImuSample& believed) const;
  /// The rates that are kept between this believed sample and the one before, in order of their
  /// stamps; valid until the next sample.
  [[nodiscard]] std::span<const KeptRate> rates_before(const ImuSample& believed) const;

 private:
  void keep_rates(const ImuSample& after, const ImuSample& last, double reachable_radps);

  std::array<ImuSample, kLongest> refused_{};
  std::size_t count_ = 0;  ///< since the last believed sample; kLongest + 1: too many
  Eigen::Vector3d by_refused_mps_ = Eigen::Vector3d::Zero();

  Eigen::Vector3d velocity_mps_ = Eigen::Vector3d::Zero();
  Timestamp velocity_until_ = kNever;  ///< the believed sample after it
  std::array<KeptRate, kLongest> rates_{};
  std::size_t rate_count_ = 0;
  Timestamp rates_until_ = kNever;  ///< the believed sample after them
};

}  // namespace crepes
