/// Where a neighbor is now, by readings that are not yet fused for good.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "estimator/relative/imu_history.hpp"
#include "estimator/swarm/hypotheses.hpp"

namespace crepes {

/// What a look ahead runs over.
struct AwaitedReadings {
  std::span<const Measurement> pending;  ///< in order of their stamps
  const ImuHistory& imu_B;
  const ImuHistory& imu_N;
};

/// Runs a copy of the leading filter over what still waits for late readings. Each look goes on
/// from the last one, as far as nothing has come in between: so a reading is taken twice or thrice,
/// and not at every look until the lag has passed.
class LookAhead {
 public:
  LookAhead(PairMounting mounting, const Gates& gates)
      : mounting_(std::move(mounting)), gates_(gates) {}

  /// The leading filter at `t`. There must be a leader, not later than `t`, and samples of both
  /// IMUs.
  [[nodiscard]] NeighborTrack at(Timestamp t, const Hypotheses& hypotheses,
                                 const AwaitedReadings& readings);
  /// Something came for `stamp`: the next look does not go on from later than that.
  void look_again_from(Timestamp stamp);

 private:
  void run(NeighborTrack& track, Timestamp to, const AwaitedReadings& readings) const;

  PairMounting mounting_;
  Gates gates_;
  // The last look, up to where nothing was expected any more.
  struct Seen {
    NeighborTrack track;
    std::uint32_t generation;
  };
  std::optional<Seen> seen_;
};

}  // namespace crepes
