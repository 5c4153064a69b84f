#include "estimator/swarm/event_sequencer.hpp"

#include <algorithm>
#include <utility>

namespace crepes {

bool EventSequencer::push(Measurement measurement) {
  if (measurement.stamp < released_) return false;
  const auto place = std::upper_bound(
      pending_.begin(), pending_.end(), measurement.stamp,
      [](Timestamp stamp, const Measurement& other) { return stamp < other.stamp; });
  pending_.insert(place, std::move(measurement));
  if (pending_.size() > kCapacity) {
    pending_.erase(pending_.begin());
    ++dropped_;
  }
  return true;
}

std::optional<Measurement> EventSequencer::pop_ready(Timestamp now) {
  if (pending_.empty() || pending_.front().stamp > now - lag_) return std::nullopt;
  Measurement oldest = std::move(pending_.front());
  pending_.erase(pending_.begin());
  released_ = oldest.stamp;
  return oldest;
}

}  // namespace crepes
