#include "estimator/swarm/measurement.hpp"

#include <algorithm>

namespace crepes {
namespace {

bool are_alternatives(const Measurement& a, const Measurement& b) {
  if (a.stamp != b.stamp || a.kind != b.kind) return false;
  const auto* bearing = std::get_if<DirectionReading>(&a.reading);
  const auto* other = std::get_if<DirectionReading>(&b.reading);
  return bearing == nullptr || other == nullptr || bearing->camera == other->camera;
}

}  // namespace

std::span<const Measurement> leading_group(std::span<const Measurement> ordered) {
  const auto end = std::find_if(ordered.begin(), ordered.end(), [&](const Measurement& m) {
    return !are_alternatives(m, ordered.front());
  });
  return {ordered.begin(), end};
}

}  // namespace crepes
