#include "estimator/vision/ring_finder.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "estimator/vision/rings/ring_completion.hpp"

namespace crepes {
namespace {

constexpr double kMaxBend = 0.2;     // sine; a ring turns one way, and the edge of a square hardly
constexpr double kLensMiddle = 0.4;  // of the radius: the lens of the board's camera
constexpr double kAlone = 2.5;       // of the radius: few lights have no others nearer
constexpr double kFewRms = 0.5;      // of what is allowed to more
constexpr double kFarRadius = 16.0;  // px; a larger board is near, and bright

Eigen::Vector2d middle_of(const LightField& field, std::span<const std::uint32_t> members) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const std::uint32_t i : members) middle += field.place_of(i);
  middle /= static_cast<double>(members.size());
  return middle;
}

/// Orders the lights by their angle about the middle. False if the outline is not convex.
bool order_around(const LightField& field, std::span<std::uint32_t> members) {
  const Eigen::Vector2d middle = middle_of(field, members);
  struct Around {
    double angle;
    std::uint32_t light;
  };
  std::array<Around, kMaxRingLeds> around{};
  for (std::size_t k = 0; k < members.size(); ++k) {
    const Eigen::Vector2d d = field.place_of(members[k]) - middle;
    around[k] = {std::atan2(d.y(), d.x()), members[k]};
  }
  std::sort(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(members.size()),
            [](const Around& a, const Around& b) {
              return a.angle != b.angle ? a.angle < b.angle : a.light < b.light;
            });
  for (std::size_t k = 0; k < members.size(); ++k) members[k] = around[k].light;
  for (std::size_t k = 0; k < members.size(); ++k) {
    const Eigen::Vector2d a = field.place_of(members[k]);
    const Eigen::Vector2d b = field.place_of(members[(k + 1) % members.size()]);
    const Eigen::Vector2d c = field.place_of(members[(k + 2) % members.size()]);
    if (cross_of(b - a, c - b) < -kMaxBend * (b - a).norm() * (c - b).norm()) return false;
  }
  return true;
}

}  // namespace

RingFinder::RingFinder() {
  candidates_.reserve(LightField::kMaxLights);
  is_taken_.reserve(LightField::kMaxLights);
  rings_.reserve(LightField::kMaxLights / 3);
}

std::span<const Ring> RingFinder::find(std::span<const Light> lights, const GrayImage& image,
                                       int threshold) {
  rings_.clear();
  // More than kMaxLights is a scene of lights, searched for no rings.
  if (lights.size() < 3 || lights.size() > LightField::kMaxLights) return rings_;
  field_.set(lights, image, threshold);
  is_taken_.assign(lights.size(), 0);
  groups_.link_nearest(field_);
  join_whole();
  accept();
  join_parts();
  accept();
  for (std::uint32_t i = 0; i < field_.size(); ++i)
    if (is_taken_[i] == 0) grow_from(i);
  accept();
  return rings_;
}

void RingFinder::join_whole() {
  groups_.restart();
  while (const auto group = groups_.next(field_, is_taken_)) judge_whole(*group);
}

void RingFinder::join_parts() {
  groups_.restart();
  while (const auto group = groups_.next(field_, is_taken_)) judge_part(*group);
}

/// Puts the ring whose LEDs are all of these lights, but for a lens, among the candidates.
void RingFinder::judge_whole(std::span<const std::uint32_t> group) {
  if (group.size() < kMinRingLeds) return;
  LightGroups::Members members{};
  std::copy(group.begin(), group.end(), members.begin());
  if (group.size() <= kMaxRingLeds) {
    const auto around = std::span(members).first(group.size());
    if (order_around(field_, around)) {
      if (const auto ring = fitter_.whole_ring(field_, around)) candidates_.push_back(*ring);
      return;
    }
  }
  const Eigen::Vector2d middle = middle_of(field_, group);
  const auto off = [&](std::uint32_t i) { return (field_.place_of(i) - middle).squaredNorm(); };
  auto* const lens =
      std::min_element(members.data(), members.data() + group.size(),
                       [&](std::uint32_t a, std::uint32_t b) { return off(a) < off(b); });
  std::swap(*lens, members[group.size() - 1]);
  const auto around = std::span(members).first(group.size() - 1);
  if (around.size() < kMinRingLeds || !order_around(field_, around)) return;
  const auto ring = fitter_.whole_ring(field_, around);
  const Eigen::Vector2d of_lens = field_.place_of(members[group.size() - 1]);
  if (ring && ring->view.place_near(of_lens).norm() < kLensMiddle) candidates_.push_back(*ring);
}

/// Puts the ring of which these lights are an arc among the candidates.
void RingFinder::judge_part(std::span<const std::uint32_t> group) {
  if (group.size() > kMaxRingLeds) return;
  LightGroups::Members members{};
  std::copy(group.begin(), group.end(), members.begin());
  const auto around = std::span(members).first(group.size());
  if (!order_around(field_, around)) return;
  const auto ring =
      group.size() == 3 ? fitter_.half_ring(field_, around) : fitter_.arc(field_, around);
  if (ring) candidates_.push_back(*ring);
}

/// Finds rings that have other lights too near, from four LEDs in a row. The second of them is b.
void RingFinder::grow_from(std::uint32_t b) {
  const auto is_usable = [&](std::uint32_t i, std::uint32_t other) {
    return i != other && is_taken_[i] == 0;
  };
  for (const std::uint32_t c : groups_.nearest_to(b)) {
    if (!is_usable(c, b)) continue;
    const Eigen::Vector2d bc = field_.place_of(c) - field_.place_of(b);
    for (const std::uint32_t a : groups_.nearest_to(b)) {
      if (!is_usable(a, b) || a == c) continue;
      const Eigen::Vector2d ab = field_.place_of(b) - field_.place_of(a);
      const double turn = cross_of(ab, bc);
      for (const std::uint32_t d : groups_.nearest_to(c)) {
        if (!is_usable(d, c) || d == a || d == b) continue;
        const Eigen::Vector2d cd = field_.place_of(d) - field_.place_of(c);
        if (turn * cross_of(bc, cd) <= 0.0) continue;
        fitter_.add_rings_with(field_, {a, b, c, d}, candidates_);
      }
    }
  }
}

/// Whether no free light could form a larger ring with these.
bool RingFinder::is_alone(const Ring& ring) const {
  const double reach = kAlone * ring.view.radius();
  const auto members = ring.members();
  for (const std::uint32_t i : field_.from_column(ring.view.center.x() - reach)) {
    if (!(field_[i].u <= ring.view.center.x() + reach)) break;
    if (is_taken_[i] != 0) continue;
    const double off = ring.view.place_near(field_.place_of(i)).norm();
    if (off > kAlone || off < kLensMiddle) continue;
    if (std::find(members.begin(), members.end(), i) == members.end()) return false;
  }
  return true;
}

/// Whether a ring of few lights, or an arc, has enough evidence to be accepted.
bool RingFinder::is_credible(const Ring& ring) const {
  if (ring.is_whole() && ring.count > kFewLights) return true;
  const double radius = ring.view.radius();
  return ring.rms <= kFewRms * ring_tolerance(radius) &&
         (radius <= kFarRadius || field_.are_leds(ring.members())) &&
         (ring.count > kFewLights || is_alone(ring));
}

/// The rings of most lights among the candidates first.
void RingFinder::accept() {
  std::sort(candidates_.begin(), candidates_.end(), [](const Ring& a, const Ring& b) {
    if (a.count != b.count) return a.count > b.count;
    if (a.leds != b.leds) return a.leds < b.leds;
    return a.rms != b.rms ? a.rms < b.rms : a.lights < b.lights;
  });
  for (const Ring& ring : candidates_) {
    const auto members = ring.members();
    const bool is_free = std::all_of(members.begin(), members.end(),
                                     [&](std::uint32_t i) { return is_taken_[i] == 0; });
    if (!is_free || !is_credible(ring)) continue;
    for (const std::uint32_t i : members) is_taken_[i] = 1;
    rings_.push_back(ring);
  }
  candidates_.clear();
}

}  // namespace crepes
