/// One hypothesis about a neighbor's pose, as a sum of Gaussians.
#pragma once

#include <span>
#include <vector>

#include "estimator/swarm/neighbor_track.hpp"

namespace crepes {

/// The result of fusing a group of alternatives, of which at most one is true.
struct Association {
  std::size_t chosen = 0;  ///< index of the most likely alternative
  Fusion fusion;           ///< of the chosen one
  double score = 0.0;      ///< log likelihood ratio: the chosen one is true, or all are clutter
};

/// ln of the likelihood of a reading given the filter, over its likelihood as clutter. At least
/// zero for a gated reading; zero for one that was not compared.
[[nodiscard]] double log_likelihood_ratio(const Fusion& fusion, MeasurementKind kind);

/// A weighted bank of filters (Alspach and Sorenson 1972). They differ in what the first reading
/// left open, for example 10 degrees of roll: too much for one linearization, not for each part.
/// `prune` removes parts that became unlikely or equal to another; after a second one is left.
///
/// Where a heading is open, each part holds its own, and the weights alone tell headings apart
/// (multiple-model estimation; Magill 1965) until few parts are left. A filter that estimates it
/// from the start, with a tilt known to 10 degrees and an unknown speed, linearizes about a wrong
/// motion and becomes certain of whatever heading it began with. Of what a reading tells, a part
/// counts: directions and ranges share errors that their filters take for white noise (a power of
/// the likelihood; Miller and Dunson 2019).
class GaussianSum {
 public:
  explicit GaussianSum(const NeighborTrack& whole);
  /// Parts of equal weight, each of which holds its heading.
  explicit GaussianSum(std::vector<NeighborTrack> parts);

  /// Sets the process noise of all parts.
  void set_noise(const ProcessNoise& noise);
  /// Propagates all parts to `to`.
  void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);
  /// Corrects every part with the candidate that is most likely for the heaviest part.
  Association fuse(std::span<const Measurement> candidates, const PairMounting& mounting,
                   const Gates& gates);
  void prune();

  /// True if the heaviest parts of both are equal within the covariance of this one.
  [[nodiscard]] bool is_compatible_with(const GaussianSum& other) const;
  [[nodiscard]] const NeighborTrack& heaviest() const;
  [[nodiscard]] std::size_t size() const { return parts_.size(); }
  /// Whether the parts hold headings, which the weights tell apart.
  [[nodiscard]] bool has_open_heading() const { return has_open_heading_; }

  /// Mean and covariance of the sum. `heaviest` is the heaviest part, propagated to a later instant
  /// by these IMUs; the result is at that instant.
  [[nodiscard]] GaussianPose mean(const NeighborTrack& heaviest, const ImuHistory& imu_B,
                                  const ImuHistory& imu_N) const;

 private:
  struct Part {
    NeighborTrack track;
    double log_weight = 0.0;
    double gain = 0.0;  ///< what the latest reading tells
  };
  [[nodiscard]] double log_mean_gain() const;
  void normalize();

  std::vector<Part> parts_;
  bool has_open_heading_ = false;
  std::size_t heaviest_ = 0;
};

}  // namespace crepes
