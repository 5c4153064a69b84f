#include "estimator/swarm/look_ahead.hpp"

#include <algorithm>

namespace crepes {
namespace {

// A robot's bearings come so much later than its IMU samples: a frame and a half.
constexpr Duration kBearingDelay = std::chrono::milliseconds{10};

}  // namespace

NeighborTrack LookAhead::at(Timestamp t, const Hypotheses& hypotheses,
                            const AwaitedReadings& readings) {
  const GaussianSum& leader = hypotheses.leader();
  const std::uint32_t generation = hypotheses.generation();
  const bool goes_on = seen_ && seen_->generation == generation &&
                       seen_->track.stamp() > leader.heaviest().stamp() &&
                       seen_->track.stamp() <= t;
  if (!goes_on) seen_ = Seen{leader.heaviest(), generation};
  const Timestamp sure =
      std::min({readings.imu_B.newest().stamp, readings.imu_N.newest().stamp, t}) - kBearingDelay;
  if (leader.size() == 1 && sure > seen_->track.stamp()) run(seen_->track, sure, readings);
  NeighborTrack track = seen_->track;
  run(track, t, readings);
  return track;
}

void LookAhead::look_again_from(Timestamp stamp) {
  if (seen_ && stamp <= seen_->track.stamp()) seen_.reset();
}

void LookAhead::run(NeighborTrack& track, Timestamp to, const AwaitedReadings& readings) const {
  const auto next =
      std::ranges::upper_bound(readings.pending, track.stamp(), {}, &Measurement::stamp);
  for (std::span rest(next, readings.pending.end()); !rest.empty() && rest.front().stamp <= to;) {
    const auto group = leading_group(rest);
    rest = rest.subspan(group.size());
    track.advance_to(group.front().stamp, readings.imu_B, readings.imu_N);
    static_cast<void>(track.fuse(group[track.likeliest(group, mounting_)], mounting_, gates_));
  }
  track.advance_to(to, readings.imu_B, readings.imu_N);
}

}  // namespace crepes
