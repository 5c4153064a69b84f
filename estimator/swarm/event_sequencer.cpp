#include "estimator/swarm/event_sequencer.hpp"

#include <algorithm>
#include <utility>

namespace crepes {
namespace {

bool are_rivals(const Measurement& a, const Measurement& b) {
  if (a.stamp != b.stamp || a.kind != b.kind) return false;
  const auto* bearing = std::get_if<DirectionReading>(&a.reading);
  const auto* other = std::get_if<DirectionReading>(&b.reading);
  return bearing == nullptr || other == nullptr || bearing->camera == other->camera;
}

}  // namespace

std::span<const Measurement> leading_group(std::span<const Measurement> ordered) {
  const auto end = std::find_if(ordered.begin(), ordered.end(), [&](const Measurement& m) {
    return !are_rivals(m, ordered.front());
  });
  return {ordered.begin(), end};
}

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

std::span<const Measurement> EventSequencer::pop_ready(Timestamp now) {
  if (pending_.empty() || pending_.front().stamp > now - lag_) return {};
  released_ = pending_.front().stamp;
  const auto count = static_cast<std::ptrdiff_t>(leading_group(pending_).size());
  ready_.assign(pending_.begin(), pending_.begin() + count);
  pending_.erase(pending_.begin(), pending_.begin() + count);
  return ready_;
}

}  // namespace crepes
