/// The current state of a neighbor, from readings that its filter has not yet fused.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "estimator/core/imu_history.hpp"
#include "estimator/swarm/hypothesis_set.hpp"

namespace crepes {

/// The input of a prediction.
struct PendingReadings {
  std::span<const Measurement> pending;  ///< in order of their stamps
  const ImuHistory& imu_B;
  const ImuHistory& imu_N;
};

/// Propagates a copy of the leading filter to the present and corrects it with the readings that
/// the reorder buffer still holds. A checkpoint avoids repetition: each prediction continues from
/// the last one, unless a reading has arrived for an earlier instant.
class OutputPredictor {
 public:
  OutputPredictor(PairMounting mounting, const Gates& gates)
      : mounting_(std::move(mounting)), gates_(gates) {}

  /// The leading filter at `t`. Requires a leader not later than `t`, and samples of both IMUs.
  [[nodiscard]] NeighborTrack predict(Timestamp t, const HypothesisSet& hypotheses,
                                      const PendingReadings& readings);
  /// A reading or sample has arrived for `stamp`: later checkpoints are no longer valid.
  void invalidate_from(Timestamp stamp);

 private:
  void advance(NeighborTrack& track, Timestamp to, const PendingReadings& readings) const;

  PairMounting mounting_;
  Gates gates_;
  /// The last prediction, up to the instant before which no more readings are expected.
  struct Checkpoint {
    NeighborTrack track;
    std::uint32_t generation;
  };
  std::optional<Checkpoint> checkpoint_;
};

}  // namespace crepes
