#include "estimator/vision/rings/half_ring.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>

namespace crepes {
namespace {

/// Three LEDs of one blob, or three blobs.
struct HalfRing {
  double spacing_tolerance;
  double min_cosine;  // of the corner
  double max_cosine;
};
constexpr HalfRing kOneBlob{1.35, -0.77, -0.26};     // 105 to 140 degrees
constexpr HalfRing kThreeBlobs{1.45, -0.82, -0.17};  // 100 to 145 degrees
constexpr double kHalfMinSpacing = 3.5;              // px, in one blob
constexpr double kHalfMaxSpacing = 24.0;             // px; two robots 5 m away would be 30 cm apart
constexpr double kHalfArea = 1.6;                    // of three blobs

}  // namespace

/// Three lights a, b, c of a regular hexagon have its center at a + c - b.
std::optional<Ring> half_ring_of_six(const LightField& field, const RingShape& hexagon,
                                     std::span<const std::uint32_t> members) {
  std::optional<Ring> best;
  double widest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::array lights{members[k], members[(k + 1) % 3], members[(k + 2) % 3]};
    const Eigen::Vector2d corner = field.place_of(lights[1]);
    const Eigen::Vector2d ba = field.place_of(lights[0]) - corner;
    const Eigen::Vector2d bc = field.place_of(lights[2]) - corner;
    const double shorter = std::min(ba.norm(), bc.norm());
    const double longer = std::max(ba.norm(), bc.norm());
    const double cosine = ba.dot(bc) / (shorter * longer);
    const bool is_one_blob = std::all_of(lights.begin(), lights.end(), [&](std::uint32_t i) {
      return field[i].blob == field[lights[1]].blob;
    });
    const HalfRing& form = is_one_blob ? kOneBlob : kThreeBlobs;
    if (longer > form.spacing_tolerance * shorter || cosine < form.min_cosine ||
        cosine > form.max_cosine || -cosine < widest)
      continue;
    if (is_one_blob ? shorter < kHalfMinSpacing
                    : longer > kHalfMaxSpacing || !field.are_leds(lights) ||
                          !field.are_alike(lights, kHalfArea))
      continue;
    widest = -cosine;
    std::array<Eigen::Vector2d, 3> seen;
    for (std::size_t i = 0; i < 3; ++i) seen[i] = field.place_of(lights[i]);
    const auto view = fit_from_afar(seen, std::span(hexagon.places).first(3));
    if (!view) continue;
    best = Ring{.view = *view, .leds = 6, .count = 3};
    std::copy(lights.begin(), lights.end(), best->lights.begin());
    for (std::size_t led = 3; led < 6; ++led)
      if (field.is_lit(view->at(hexagon.places[led]))) best.reset();
    if (!best) return std::nullopt;
  }
  return best;
}

}  // namespace crepes
