#include "estimator/vision/ring_finder.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr std::size_t kMaxLights = 1024;  // more is a scene of lights, searched for no rings
constexpr std::size_t kNeighbors = 4;
constexpr double kMaxSpacing = 60.0;  // px between LEDs: the ring at 0.3 m
constexpr double kMinSpacing = 2.5;   // px; closer ones are one light
constexpr double kSimilarArea = 4.0;
constexpr double kCenterTolerance = 0.15;     // of the ring's radius
constexpr double kNearCenterTolerance = 0.2;  // the same where perspective shows
constexpr double kNear = 10.0;                // px radius
constexpr double kMaxCornerCosine = -0.1;     // corners of 96
constexpr double kMinCornerCosine = -0.93;    // to 158 degrees, as a tilted ring shows
constexpr double kDarkMiddle = 0.35;          // of the radius: there is the camera, and no LED
constexpr double kSpacingTolerance = 2.2;     // longer to shorter side, as a tilted ring shows

// Half a ring: three LEDs of one blob, or three blobs.
struct HalfRing {
  double spacing_tolerance;
  double min_cosine;  // of the corner
  double max_cosine;
};
constexpr HalfRing kOneBlob{1.35, -0.77, -0.26};     // 105 to 140 degrees
constexpr HalfRing kThreeBlobs{1.45, -0.82, -0.17};  // 100 to 145 degrees
constexpr double kHalfMinSpacing = 3.5;              // px, in one blob
constexpr double kHalfSpacing = 24.0;                // px: two robots 5 m away would be 30 cm apart
constexpr std::int32_t kHalfMinArea = 8;
constexpr double kHalfSimilarArea = 1.6;
constexpr int kSaturatedPeak = 250;

struct Vec {
  double u, v;
};
Vec between(const Light& from, const Light& to) { return {to.u - from.u, to.v - from.v}; }
double dot(Vec a, Vec b) { return a.u * b.u + a.v * b.v; }
double length(Vec a) { return std::sqrt(dot(a, a)); }

/// The point nearest to the lines through opposite LEDs; (u, v) itself if there are less than two.
Vec meeting_of_diagonals(std::span<const Light> lights, const Ring& ring) {
  constexpr double kOpposite = -0.94;  // cosine of 160 degrees
  double a_uu = 0.0;
  double a_uv = 0.0;
  double a_vv = 0.0;
  double b_u = 0.0;
  double b_v = 0.0;
  int lines = 0;
  for (std::size_t i = 0; i < ring.count; ++i) {
    for (std::size_t j = i + 1; j < ring.count; ++j) {
      const Light& p = lights[ring.lights[i]];
      const Light& q = lights[ring.lights[j]];
      const Vec to_p{p.u - ring.u, p.v - ring.v};
      const Vec to_q{q.u - ring.u, q.v - ring.v};
      if (dot(to_p, to_q) > kOpposite * length(to_p) * length(to_q)) continue;
      const Vec d = between(p, q);
      const Vec n{-d.v / length(d), d.u / length(d)};
      const double offset = n.u * p.u + n.v * p.v;
      a_uu += n.u * n.u;
      a_uv += n.u * n.v;
      a_vv += n.v * n.v;
      b_u += n.u * offset;
      b_v += n.v * offset;
      ++lines;
    }
  }
  const double det = a_uu * a_vv - a_uv * a_uv;
  constexpr double kFlat = 0.05;
  if (lines < 2 || lines > 3 || det < kFlat) return {ring.u, ring.v};
  return {(a_vv * b_u - a_uv * b_v) / det, (a_uu * b_v - a_uv * b_u) / det};
}

bool are_alike(const Light& a, const Light& b, double factor) {
  return a.area <= factor * b.area && b.area <= factor * a.area;
}

/// Whether three LEDs a, b, c are half a ring by themselves.
bool is_half_ring(const Light& a, const Light& b, const Light& c) {
  const Vec ba = between(b, a);
  const Vec bc = between(b, c);
  const double shorter = std::min(length(ba), length(bc));
  const double longer = std::max(length(ba), length(bc));
  const double cosine = dot(ba, bc) / (shorter * longer);
  const bool is_one_blob = a.blob == b.blob && b.blob == c.blob;
  const HalfRing& shape = is_one_blob ? kOneBlob : kThreeBlobs;
  if (longer > shape.spacing_tolerance * shorter || cosine < shape.min_cosine ||
      cosine > shape.max_cosine)
    return false;
  if (is_one_blob) return shorter >= kHalfMinSpacing;
  const auto is_led = [](const Light& x) {
    return x.peak >= kSaturatedPeak && x.area >= kHalfMinArea;
  };
  return longer <= kHalfSpacing && is_led(a) && is_led(b) && is_led(c) &&
         are_alike(a, b, kHalfSimilarArea) && are_alike(b, c, kHalfSimilarArea) &&
         are_alike(a, c, kHalfSimilarArea);
}

}  // namespace

RingFinder::RingFinder() {
  constexpr std::size_t kVotes = kNeighbors * (kNeighbors - 1) / 2;
  order_.reserve(kMaxLights);
  votes_.reserve(kMaxLights * kVotes);
  is_taken_.reserve(kMaxLights);
  rings_.reserve(kMaxLights / 3);
}

std::span<const Ring> RingFinder::find(std::span<const Light> lights) {
  rings_.clear();
  order_.clear();
  if (lights.size() < 3 || lights.size() > kMaxLights) return rings_;
  for (std::uint32_t i = 0; i < lights.size(); ++i) order_.push_back(i);
  std::sort(order_.begin(), order_.end(),
            [&](std::uint32_t a, std::uint32_t b) { return lights[a].u < lights[b].u; });
  is_taken_.assign(lights.size(), 0);
  votes_.clear();
  for (std::size_t i = 0; i < order_.size(); ++i) vote(lights, order_[i], i);
  std::sort(votes_.begin(), votes_.end(), [](const Vote& a, const Vote& b) { return a.u < b.u; });

  // The ring that most lights agree on first.
  for (std::size_t least = 6; least >= 4; --least)
    for (std::size_t i = 0; i < votes_.size(); ++i) count_votes(lights, i, least);
  accept_half_rings(lights);
  return rings_;
}

/// Votes of the light `corner`, which is at `place` in order_, with pairs of its neighbors.
void RingFinder::vote(std::span<const Light> lights, std::uint32_t corner, std::size_t place) {
  struct Neighbor {
    double distance = 1e9;
    std::uint32_t light = 0;
  };
  std::array<Neighbor, kNeighbors> near{};
  const Light& b = lights[corner];
  const auto consider = [&](std::uint32_t other) {
    const Vec d = between(b, lights[other]);
    if (std::abs(d.u) > kMaxSpacing) return false;
    if (std::abs(d.v) > kMaxSpacing || !are_alike(b, lights[other], kSimilarArea)) return true;
    const double distance = length(d);
    if (distance < kMinSpacing || distance > kMaxSpacing || distance >= near.back().distance)
      return true;
    near.back() = {distance, other};
    std::sort(near.begin(), near.end(),
              [](const Neighbor& x, const Neighbor& y) { return x.distance < y.distance; });
    return true;
  };
  for (std::size_t j = place + 1; j < order_.size() && consider(order_[j]); ++j) {
  }
  for (std::size_t j = place; j > 0 && consider(order_[j - 1]); --j) {
  }
  for (std::size_t i = 0; i < kNeighbors; ++i) {
    for (std::size_t j = i + 1; j < kNeighbors; ++j) {
      if (near[j].distance > kSpacingTolerance * near[i].distance) continue;
      const Light& a = lights[near[i].light];
      const Light& c = lights[near[j].light];
      // The corner at b is 120 degrees, less when the ring is tilted.
      const double cosine =
          dot(between(b, a), between(b, c)) / (near[i].distance * near[j].distance);
      if (cosine > kMaxCornerCosine || cosine < kMinCornerCosine) continue;
      const double u = a.u + c.u - b.u;
      const double v = a.v + c.v - b.v;
      votes_.push_back({u, v, length({u - b.u, v - b.v}), {near[i].light, corner, near[j].light}});
    }
  }
}

bool RingFinder::is_free(const Vote& vote) const {
  return std::none_of(vote.lights.begin(), vote.lights.end(),
                      [&](std::uint32_t light) { return is_taken_[light] != 0; });
}

/// Makes a ring of the votes near votes_[seed] if they are of `least` lights.
void RingFinder::count_votes(std::span<const Light> lights, std::size_t seed_index,
                             std::size_t least) {
  const Vote& seed = votes_[seed_index];
  if (!is_free(seed)) return;
  const double tolerance =
      (seed.radius > kNear ? kNearCenterTolerance : kCenterTolerance) * seed.radius;
  Ring ring;
  std::size_t agreeing = 0;
  const auto include = [&](const Vote& vote) {
    if (std::abs(vote.v - seed.v) > tolerance || vote.radius > kSpacingTolerance * seed.radius ||
        seed.radius > kSpacingTolerance * vote.radius || !is_free(vote))
      return;
    for (const std::uint32_t light : vote.lights) {
      auto* const end = ring.lights.begin() + static_cast<std::ptrdiff_t>(ring.count);
      if (std::find(ring.lights.begin(), end, light) != end) continue;
      if (ring.count == ring.lights.size()) return;
      ring.lights[ring.count++] = light;
    }
    ring.u += vote.u;
    ring.v += vote.v;
    ++agreeing;
  };
  for (std::size_t j = seed_index; j > 0 && seed.u - votes_[j - 1].u <= tolerance; --j)
    include(votes_[j - 1]);
  for (std::size_t j = seed_index; j < votes_.size() && votes_[j].u - seed.u <= tolerance; ++j)
    include(votes_[j]);
  if (ring.count < least || agreeing + 2 < ring.count) return;
  ring.u /= static_cast<double>(agreeing);
  ring.v /= static_cast<double>(agreeing);
  const Vec center = meeting_of_diagonals(lights, ring);
  ring.u = center.u;
  ring.v = center.v;
  if (std::any_of(lights.begin(), lights.end(), [&](const Light& light) {
        return length({light.u - ring.u, light.v - ring.v}) < kDarkMiddle * seed.radius;
      }))
    return;
  for (std::size_t i = 0; i < ring.count; ++i) is_taken_[ring.lights[i]] = 1;
  rings_.push_back(ring);
}

void RingFinder::accept_half_rings(std::span<const Light> lights) {
  for (const Vote& vote : votes_) {
    const auto& [a, b, c] = vote.lights;
    if (!is_free(vote) || !is_half_ring(lights[a], lights[b], lights[c])) continue;
    is_taken_[a] = is_taken_[b] = is_taken_[c] = 1;
    rings_.push_back({vote.u, vote.v, {a, b, c}, 3});
  }
}

}  // namespace crepes
