#include "estimator/swarm/reorder_buffer.hpp"

#include <algorithm>
#include <utility>

namespace crepes {
namespace {

/// A distance by a ring comes with its bearing, but after all bearings of the frame: these are
/// alternatives.
std::pair<Timestamp, bool> order_of(const Measurement& measurement) {
  return {measurement.stamp, measurement.kind == MeasurementKind::kRingDistance};
}

}  // namespace

bool ReorderBuffer::push(Measurement measurement) {
  // A pose of the graph is no reading: it is late because it took time to estimate.
  if (measurement.kind != MeasurementKind::kGraphPose && now_ > Timestamp::min())
    lag_.add(now_ - measurement.stamp);
  if (measurement.stamp < released_) return false;
  const auto place =
      std::upper_bound(pending_.begin(), pending_.end(), order_of(measurement),
                       [](const auto& order, const Measurement& m) { return order < order_of(m); });
  pending_.insert(place, std::move(measurement));
  if (pending_.size() > kCapacity) {
    pending_.erase(pending_.begin());
    ++dropped_;
  }
  return true;
}

std::span<const Measurement> ReorderBuffer::pop_ready(Timestamp now) {
  now_ = now;
  if (pending_.empty() || pending_.front().stamp > now - lag_.value()) return {};
  released_ = pending_.front().stamp;
  const auto count = static_cast<std::ptrdiff_t>(leading_group(pending_).size());
  ready_.assign(pending_.begin(), pending_.begin() + count);
  pending_.erase(pending_.begin(), pending_.begin() + count);
  return ready_;
}

}  // namespace crepes
