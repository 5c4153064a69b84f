#include "estimator/vision/rings/ring_fitter.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "estimator/vision/rings/half_ring.hpp"
#include "estimator/vision/rings/ring_completion.hpp"

namespace crepes {
namespace {

constexpr double kFewArea = 1.8;        // the areas of lights, where they are few
constexpr double kRowTolerance = 0.15;  // of the middle spacing, of four LEDs in a row

/// In how many ways the LEDs of a shape can be counted.
std::size_t shifts_of(const RingShape& shape) {
  return shape.is_round() ? 1 : shape.places.size() / 4;
}

}  // namespace

RingFitter::RingFitter() : hexagon_(RingShape::round(6)) {
  for (int leds = kMinRingLeds; leds <= kMaxRingLeds; ++leds) {
    shapes_.push_back(RingShape::round(leds));
    if (leds % 4 == 0 && leds > 4) shapes_.push_back(RingShape::square(leds));
  }
}

std::optional<Ring> RingFitter::whole_ring(const LightField& field,
                                           std::span<const std::uint32_t> members) const {
  std::optional<Ring> best;
  const auto leds = members.size();
  for (const RingShape& shape : shapes_) {
    if (shape.places.size() != leds) continue;
    for (std::size_t shift = 0; shift < shifts_of(shape); ++shift) {
      Ring ring{.leds = shape.leds(), .count = leds};
      std::copy(members.begin(), members.end(), ring.lights.begin());
      if (complete_ring(field, shape, shift, ring) && (!best || ring.rms < best->rms)) best = ring;
    }
  }
  return best;
}

std::optional<Ring> RingFitter::arc(const LightField& field,
                                    std::span<const std::uint32_t> members) const {
  if (members.size() <= kFewLights && !field.are_alike(members, kFewArea)) return std::nullopt;
  struct Gap {
    double length = 0.0;
    std::size_t after = 0;
  };
  std::array<Gap, 2> gaps{};
  for (std::size_t k = 0; k < members.size(); ++k) {
    const std::size_t after = (k + 1) % members.size();
    const double length = (field.place_of(members[after]) - field.place_of(members[k])).norm();
    if (length > gaps[0].length) {
      gaps = {Gap{length, after}, gaps[0]};
    } else if (length > gaps[1].length) {
      gaps[1] = {length, after};
    }
  }
  std::optional<Ring> best;
  for (const Gap& gap : gaps) {
    const auto ring = arc_after(field, members, gap.after);
    if (ring && (!best || ring->count > best->count ||
                 (ring->count == best->count && ring->rms < best->rms)))
      best = ring;
  }
  return best;
}

/// The best arc of any shape that begins with members[first].
std::optional<Ring> RingFitter::arc_after(const LightField& field,
                                          std::span<const std::uint32_t> members,
                                          std::size_t first) const {
  const std::size_t count = members.size();
  std::array<Eigen::Vector2d, kMaxRingLeds> seen;
  std::array<std::uint32_t, kMaxRingLeds> lights{};
  for (std::size_t k = 0; k < count; ++k) {
    lights[k] = members[(first + k) % count];
    seen[k] = field.place_of(lights[k]);
  }
  const RingShape* best = nullptr;
  std::size_t best_shift = 0;
  double best_rms = 1e9;
  for (const RingShape& shape : shapes_) {
    const std::size_t leds = shape.places.size();
    if (leds <= count || leds > 2 * count) continue;
    for (std::size_t shift = 0; shift < shifts_of(shape); ++shift) {
      std::array<Eigen::Vector2d, kMaxRingLeds> places;
      for (std::size_t k = 0; k < count; ++k) places[k] = shape.places[(shift + k) % leds];
      const auto view = fit_from_afar(std::span(seen).first(count), std::span(places).first(count));
      if (!view || view->roundness() < kMinRingRoundness) continue;
      const double rms = view->rms(std::span(seen).first(count), std::span(places).first(count));
      if (rms >= best_rms) continue;
      best = &shape;
      best_shift = shift;
      best_rms = rms;
    }
  }
  if (best == nullptr) return std::nullopt;
  Ring ring{.leds = best->leds(), .lights = lights, .count = count};
  return complete_ring(field, *best, best_shift, ring) ? std::optional(ring) : std::nullopt;
}

std::optional<Ring> RingFitter::half_ring(const LightField& field,
                                          std::span<const std::uint32_t> members) const {
  return half_ring_of_six(field, hexagon_, members);
}

/// Of four LEDs a, b, c, d in a row of n, d - a is parallel to c - b and 1 + 2 cos(360 deg / n)
/// times as long.
void RingFitter::add_rings_with(const LightField& field, const std::array<std::uint32_t, 4>& row,
                                std::vector<Ring>& candidates) const {
  const Eigen::Vector2d ad = field.place_of(row[3]) - field.place_of(row[0]);
  const Eigen::Vector2d bc = field.place_of(row[2]) - field.place_of(row[1]);
  if (std::abs(cross_of(ad, bc)) > kRowTolerance * bc.squaredNorm() ||
      !field.are_alike(row, LightField::kRingArea))
    return;
  const double ratio = ad.dot(bc) / bc.squaredNorm();
  for (const RingShape& shape : shapes_) {
    const double wanted = 1.0 + 2.0 * shape.places[1].x();
    if (shape.leds() == kMinRingLeds || !shape.is_round() ||
        std::abs(wanted - ratio) > kRowTolerance)
      continue;
    Ring ring{.leds = shape.leds(), .count = row.size()};
    std::copy(row.begin(), row.end(), ring.lights.begin());
    if (complete_ring(field, shape, 0, ring) && ring.count > kFewLights) candidates.push_back(ring);
  }
}

}  // namespace crepes
