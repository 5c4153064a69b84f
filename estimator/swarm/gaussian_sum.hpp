/// One start of a neighbor's filter as a sum of Gaussians.
#pragma once

#include <span>
#include <vector>

#include "estimator/swarm/neighbor_track.hpp"

namespace crepes {

/// What became of a group of rival readings, of which at most one is true.
struct Association {
  std::size_t chosen = 0;  ///< the likeliest
  Fusion fusion;           ///< of the chosen one
  double score = 0.0;      ///< ln of its likelihood against that of all being clutter
};

/// ln of what a reading says for a filter, against its being clutter.
[[nodiscard]] double score_of(const Fusion& fusion, MeasurementKind kind);

/// Filters that differ in what the first reading left open, weighted by what came since (Alspach
/// and Sorenson 1972). What one linearization could not hold, 10 degrees of roll, each of them can.
/// Parts that became unlikely or equal to another go; after a second there is one.
class GaussianSum {
 public:
  explicit GaussianSum(const NeighborTrack& whole);
  /// Of parts that are as likely one as the other.
  explicit GaussianSum(std::vector<NeighborTrack> parts);

  void set_noise(const ProcessNoise& noise);
  void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);
  /// Corrects every part with the candidate that is likeliest to the heaviest part.
  Association fuse(std::span<const Measurement> candidates, const PairMounting& mounting,
                   const Gates& gates);
  void prune();

  /// Whether the other may be the same, by what the heaviest part knows.
  [[nodiscard]] bool is_like(const GaussianSum& other) const;
  [[nodiscard]] const NeighborTrack& heaviest() const;
  [[nodiscard]] std::size_t size() const { return parts_.size(); }

  /// The sum as one Gaussian, where `heaviest` is the heaviest part's pose now, a little later.
  [[nodiscard]] GaussianPose mean(const GaussianPose& heaviest) const;

 private:
  struct Part {
    NeighborTrack track;
    double log_weight = 0.0;
  };
  double normalize();

  std::vector<Part> parts_;
  std::size_t heaviest_ = 0;
};

}  // namespace crepes
