#include "estimator/swarm/output_predictor.hpp"

#include <algorithm>

namespace crepes {
namespace {

// Bearings of a robot arrive so much later than its IMU samples: one and a half frames.
constexpr Duration kBearingDelay = std::chrono::milliseconds{10};

}  // namespace

NeighborTrack OutputPredictor::predict(Timestamp t, const HypothesisSet& hypotheses,
                                       const PendingReadings& readings) {
  const GaussianSum& leader = hypotheses.leader();
  const std::uint32_t generation = hypotheses.generation();
  const bool is_valid = checkpoint_ && checkpoint_->generation == generation &&
                        checkpoint_->track.stamp() > leader.heaviest().stamp() &&
                        checkpoint_->track.stamp() <= t;
  if (!is_valid) checkpoint_ = Checkpoint{leader.heaviest(), generation};
  const Timestamp complete =
      std::min({readings.imu_B.newest().stamp, readings.imu_N.newest().stamp, t}) - kBearingDelay;
  if (leader.size() == 1 && complete > checkpoint_->track.stamp())
    advance(checkpoint_->track, complete, readings);
  NeighborTrack track = checkpoint_->track;
  advance(track, t, readings);
  return track;
}

void OutputPredictor::invalidate_from(Timestamp stamp) {
  if (checkpoint_ && stamp <= checkpoint_->track.stamp()) checkpoint_.reset();
}

void OutputPredictor::advance(NeighborTrack& track, Timestamp to,
                              const PendingReadings& readings) const {
  const auto next =
      std::ranges::upper_bound(readings.pending, track.stamp(), {}, &Measurement::stamp);
  for (std::span rest(next, readings.pending.end()); !rest.empty() && rest.front().stamp <= to;) {
    const auto group = leading_group(rest);
    rest = rest.subspan(group.size());
    track.advance_to(group.front().stamp, readings.imu_B, readings.imu_N);
    static_cast<void>(track.fuse(group[track.most_likely(group, mounting_)], mounting_, gates_));
  }
  track.advance_to(to, readings.imu_B, readings.imu_N);
}

}  // namespace crepes
