#include "estimator/swarm/measurement.hpp"

#include <algorithm>

namespace crepes {
namespace {

/// Null for what no camera saw.
const Eigen::Vector3d* camera_of(const Measurement& measurement) {
  if (const auto* bearing = std::get_if<DirectionReading>(&measurement.reading))
    return &bearing->camera;
  const auto* ring = std::get_if<RingReading>(&measurement.reading);
  return ring == nullptr ? nullptr : &ring->camera;
}

bool are_alternatives(const Measurement& a, const Measurement& b) {
  if (a.stamp != b.stamp || a.kind != b.kind) return false;
  const Eigen::Vector3d* camera = camera_of(a);
  const Eigen::Vector3d* other = camera_of(b);
  return camera == nullptr || other == nullptr || *camera == *other;
}

}  // namespace

SensorReading reading_of(const Measurement& measurement) {
  if (const auto* bearing = std::get_if<DirectionReading>(&measurement.reading)) {
    const Eigen::Vector3d& u = bearing->u;
    const Eigen::Vector3d& p = bearing->camera;
    return {u.x(), u.y(), u.z(), p.x(), p.y(), p.z()};
  }
  if (const auto* ring = std::get_if<RingReading>(&measurement.reading)) return {ring->distance_m};
  const auto* range = std::get_if<RangeReading>(&measurement.reading);
  return range == nullptr ? SensorReading{} : SensorReading{range->range_m};
}

std::span<const Measurement> leading_group(std::span<const Measurement> ordered) {
  const auto end = std::find_if(ordered.begin(), ordered.end(), [&](const Measurement& m) {
    return !are_alternatives(m, ordered.front());
  });
  return {ordered.begin(), end};
}

}  // namespace crepes
