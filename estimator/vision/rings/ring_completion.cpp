#include "estimator/vision/rings/ring_completion.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace crepes {
namespace {

// How far LEDs are from where they should be: pixels, and parts of the radius for the lens.
constexpr double kMaxRms = 0.35;
constexpr double kMaxRmsOfRadius = 0.005;
constexpr double kPerspective = 1.0 / 250.0;  // of the radius squared: what it moves
constexpr double kLedReach = 0.25;            // of the spacing: where a further LED is looked for

/// The view in which `places` appear nearest to `seen`, the lights of the ring. False if it is
/// poor.
bool fit_view(std::span<const Eigen::Vector2d> seen, std::span<const Eigen::Vector2d> places,
              Ring& ring) {
  const auto from_afar = fit_from_afar(seen, places);
  if (!from_afar || from_afar->roundness() < kMinRingRoundness) return false;
  const double radius = from_afar->radius();
  if (from_afar->rms(seen, places) > ring_tolerance(radius) + kPerspective * radius * radius)
    return false;
  const auto view = fit_perspective(*from_afar, seen, places);
  if (!view || view->slant.norm() > kPerspective * radius) return false;
  ring.view = *view;
  ring.rms = view->rms(seen, places);
  return ring.rms <= ring_tolerance(radius);
}

/// The light where LED `led` of the shape should be, if it is like those of the ring.
std::optional<std::uint32_t> light_at(const LightField& field, const RingShape& shape,
                                      std::size_t led, const Ring& ring) {
  const Eigen::Vector2d& place = shape.places[led];
  const Eigen::Vector2d uv = ring.view.at(place);
  const double spacing = (ring.view.at(shape.places[(led + 1) % shape.places.size()]) - uv).norm();
  const double reach = std::max(1.0, kLedReach * spacing);
  for (const std::uint32_t i : field.from_column(uv.x() - reach)) {
    if (!(field[i].u <= uv.x() + reach)) break;
    const std::array pair{ring.lights[0], i};
    if ((field.place_of(i) - uv).norm() > reach || !field.are_alike(pair, LightField::kRingArea))
      continue;
    const auto members = ring.members();
    if (std::find(members.begin(), members.end(), i) == members.end()) return i;
  }
  return std::nullopt;
}

}  // namespace

double ring_tolerance(double radius) { return kMaxRms + kMaxRmsOfRadius * radius; }

bool complete_ring(const LightField& field, const RingShape& shape, std::size_t shift, Ring& ring) {
  const std::size_t leds = shape.places.size();
  std::array<Eigen::Vector2d, kMaxRingLeds> seen;
  std::array<Eigen::Vector2d, kMaxRingLeds> places;
  for (std::size_t k = 0; k < ring.count; ++k) {
    seen[k] = field.place_of(ring.lights[k]);
    places[k] = shape.places[(shift + k) % leds];
  }
  const auto fit = [&] {
    return fit_view(std::span(seen).first(ring.count), std::span(places).first(ring.count), ring);
  };
  if (!fit()) return false;
  // From both ends of the arc.
  const std::size_t arc = ring.count;
  for (std::size_t k = 0; k < leds - arc; ++k) {
    const std::size_t step = k % 2 == 0 ? arc + k / 2 : leds - 1 - k / 2;
    const std::size_t led = (shift + step) % leds;
    if (const auto light = light_at(field, shape, led, ring)) {
      ring.lights[ring.count] = *light;
      seen[ring.count] = field.place_of(*light);
      places[ring.count] = shape.places[led];
      ++ring.count;
      if (!fit()) return false;
    } else if (field.is_lit(ring.view.at(shape.places[led]))) {
      return false;
    }
  }
  return 2 * ring.count >= leds;
}

}  // namespace crepes
