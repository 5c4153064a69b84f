#include "estimator/vision/ring_finder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace crepes {
namespace {

constexpr std::size_t kMaxLights = 1024;  // more is a scene of lights, searched for no rings
constexpr std::size_t kNeighbors = 4;
constexpr double kMaxSpacing = 110.0;   // px between LEDs: four of a board of 12 cm at 0.4 m
constexpr double kMinSpacing = 2.5;     // px; closer ones are one light
constexpr double kFarSpacing = 24.0;    // px; two robots 5 m away would be 30 cm apart
constexpr double kSimilarArea = 4.0;    // of linked lights
constexpr double kRingArea = 3.0;       // of a ring's
constexpr double kFewArea = 1.8;        // where they are few
constexpr double kMinRoundness = 0.28;  // 73 degrees aslant
constexpr double kMaxBend = 0.2;  // sine; a ring turns one way, and the edge of a square hardly

// How far LEDs are from where they should be: pixels, and parts of the radius for the lens.
constexpr double kMaxRms = 0.35;
constexpr double kMaxRmsOfRadius = 0.005;
constexpr double kPerspective = 1.0 / 250.0;  // of the radius squared: what it moves
constexpr double kReach = 0.25;               // of the spacing: where a further LED is looked for

constexpr double kRowTolerance = 0.15;  // of the middle spacing, of four LEDs in a row
constexpr double kMiddle = 0.4;         // of the radius: the lens of the board's camera
constexpr double kAlone = 2.5;          // of the radius: few lights have no others nearer
constexpr std::size_t kFew = 4;         // lights
constexpr double kFewRms = 0.5;         // of what is allowed to more
constexpr double kFarRadius = 16.0;     // px; a larger board is near, and bright
constexpr std::int32_t kLedArea = 8;
constexpr int kLedPeak = 250;

// Half a ring of six: three LEDs of one blob, or three blobs.
struct HalfRing {
  double spacing_tolerance;
  double min_cosine;  // of the corner
  double max_cosine;
};
constexpr HalfRing kOneBlob{1.35, -0.77, -0.26};     // 105 to 140 degrees
constexpr HalfRing kThreeBlobs{1.45, -0.82, -0.17};  // 100 to 145 degrees
constexpr double kHalfMinSpacing = 3.5;              // px, in one blob
constexpr double kHalfArea = 1.6;

using Points = std::array<Eigen::Vector2d, kMaxRingLeds>;

Eigen::Vector2d place_of(const Light& light) { return {light.u, light.v}; }

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double tolerance(double radius) { return kMaxRms + kMaxRmsOfRadius * radius; }

/// Orders the lights by their angle about the middle. False if the outline is not convex.
bool order_around(std::span<const Light> lights, std::span<std::uint32_t> members) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const std::uint32_t i : members) middle += place_of(lights[i]);
  middle /= static_cast<double>(members.size());
  struct Around {
    double angle;
    std::uint32_t light;
  };
  std::array<Around, kMaxRingLeds> around{};
  for (std::size_t k = 0; k < members.size(); ++k) {
    const Eigen::Vector2d d = place_of(lights[members[k]]) - middle;
    around[k] = {std::atan2(d.y(), d.x()), members[k]};
  }
  std::sort(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(members.size()),
            [](const Around& a, const Around& b) {
              return a.angle != b.angle ? a.angle < b.angle : a.light < b.light;
            });
  for (std::size_t k = 0; k < members.size(); ++k) members[k] = around[k].light;
  for (std::size_t k = 0; k < members.size(); ++k) {
    const Eigen::Vector2d a = place_of(lights[members[k]]);
    const Eigen::Vector2d b = place_of(lights[members[(k + 1) % members.size()]]);
    const Eigen::Vector2d c = place_of(lights[members[(k + 2) % members.size()]]);
    if (cross(b - a, c - b) < -kMaxBend * (b - a).norm() * (c - b).norm()) return false;
  }
  return true;
}

}  // namespace

RingFinder::RingFinder() {
  for (int leds = kMinRingLeds; leds <= kMaxRingLeds; ++leds) {
    shapes_.push_back(RingShape::round(leds));
    if (leds % 4 == 0 && leds > 4) shapes_.push_back(RingShape::square(leds));
  }
  order_.reserve(kMaxLights);
  links_.reserve(kMaxLights * kNeighbors);
  near_.reserve(kMaxLights);
  parent_.reserve(kMaxLights);
  next_.reserve(kMaxLights);
  size_.reserve(kMaxLights);
  candidates_.reserve(kMaxLights);
  is_taken_.reserve(kMaxLights);
  rings_.reserve(kMaxLights / 3);
}

std::span<const Ring> RingFinder::find(std::span<const Light> lights, const GrayImage& image,
                                       int threshold) {
  rings_.clear();
  if (lights.size() < 3 || lights.size() > kMaxLights) return rings_;
  lights_ = lights;
  image_ = &image;
  threshold_ = threshold;
  const auto count = static_cast<std::uint32_t>(lights.size());
  order_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) order_[i] = i;
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return lights[a].u != lights[b].u ? lights[a].u < lights[b].u : a < b;
  });
  is_taken_.assign(count, 0);
  link_neighbors();
  join_all([&](std::span<const std::uint32_t> group) { judge_whole(group); });
  accept();
  join_all([&](std::span<const std::uint32_t> group) { judge_part(group); });
  accept();
  for (std::uint32_t i = 0; i < count; ++i)
    if (is_taken_[i] == 0) grow_from(i);
  accept();
  return rings_;
}

/// Every light with its nearest that are like it, the shortest links first.
void RingFinder::link_neighbors() {
  links_.clear();
  near_.resize(lights_.size());
  for (std::size_t place = 0; place < order_.size(); ++place) {
    const std::uint32_t a = order_[place];
    std::array<Link, kNeighbors> near{};
    near.fill({kMaxSpacing, a, a});
    const auto consider = [&](std::uint32_t b) {
      const double du = lights_[b].u - lights_[a].u;
      const double dv = lights_[b].v - lights_[a].v;
      if (std::abs(du) >= near.back().length) return false;
      if (std::abs(dv) >= near.back().length) return true;
      const double squared = du * du + dv * dv;
      if (squared < kMinSpacing * kMinSpacing ||
          squared >= near.back().length * near.back().length ||
          std::max(lights_[a].area, lights_[b].area) >
              kSimilarArea * std::min(lights_[a].area, lights_[b].area))
        return true;
      const double length = std::sqrt(squared);
      std::size_t k = kNeighbors - 1;
      for (; k > 0 && near[k - 1].length > length; --k) near[k] = near[k - 1];
      near[k] = {length, a, b};
      return true;
    };
    for (std::size_t j = place + 1; j < order_.size() && consider(order_[j]); ++j) {
    }
    for (std::size_t j = place; j > 0 && consider(order_[j - 1]); --j) {
    }
    for (const Link& link : near)
      if (link.a != link.b) links_.push_back(link);
    for (std::size_t k = 0; k < kNearest; ++k) near_[a][k] = near[k].b;
  }
  std::sort(links_.begin(), links_.end(), [](const Link& x, const Link& y) {
    if (x.length != y.length) return x.length < y.length;
    return x.a != y.a ? x.a < y.a : x.b < y.b;
  });
}

/// Finds rings that have other lights too near, from four LEDs in a row. The second of them is b.
void RingFinder::grow_from(std::uint32_t b) {
  const auto is_usable = [&](std::uint32_t i, std::uint32_t other) {
    return i != other && is_taken_[i] == 0;
  };
  for (const std::uint32_t c : near_[b]) {
    if (!is_usable(c, b)) continue;
    const Eigen::Vector2d bc = place_of(lights_[c]) - place_of(lights_[b]);
    for (const std::uint32_t a : near_[b]) {
      if (!is_usable(a, b) || a == c) continue;
      const Eigen::Vector2d ab = place_of(lights_[b]) - place_of(lights_[a]);
      const double turn = cross(ab, bc);
      for (const std::uint32_t d : near_[c]) {
        if (!is_usable(d, c) || d == a || d == b) continue;
        const Eigen::Vector2d cd = place_of(lights_[d]) - place_of(lights_[c]);
        if (turn * cross(bc, cd) <= 0.0) continue;
        grow_row({a, b, c, d});
      }
    }
  }
}

/// Of four LEDs a, b, c, d in a row of n, d - a is parallel to c - b and 1 + 2 cos(360 deg / n)
/// times as long.
void RingFinder::grow_row(const std::array<std::uint32_t, 4>& row) {
  const Eigen::Vector2d ad = place_of(lights_[row[3]]) - place_of(lights_[row[0]]);
  const Eigen::Vector2d bc = place_of(lights_[row[2]]) - place_of(lights_[row[1]]);
  if (std::abs(cross(ad, bc)) > kRowTolerance * bc.squaredNorm() || !are_alike(row, kRingArea))
    return;
  const double ratio = ad.dot(bc) / bc.squaredNorm();
  for (const RingShape& shape : shapes_) {
    const double wanted = 1.0 + 2.0 * shape.places[1].x();
    if (shape.leds() == kMinRingLeds || !shape.is_round() ||
        std::abs(wanted - ratio) > kRowTolerance)
      continue;
    Ring ring{.leds = shape.leds(), .count = row.size()};
    std::copy(row.begin(), row.end(), ring.lights.begin());
    if (complete(ring, shape, 0) && ring.count > kFew) candidates_.push_back(ring);
  }
}

/// Joins what is free, link by link, and calls judge(group) for each group that may be a ring.
template <class Judge>
void RingFinder::join_all(const Judge& judge) {
  const auto count = static_cast<std::uint32_t>(lights_.size());
  parent_.resize(count);
  next_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) parent_[i] = next_[i] = i;
  size_.assign(count, 1);
  const auto root_of = [&](std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  };
  for (const Link& link : links_) {
    if (is_taken_[link.a] != 0 || is_taken_[link.b] != 0) continue;
    const std::uint32_t a = root_of(link.a);
    const std::uint32_t b = root_of(link.b);
    if (a == b) continue;
    parent_[b] = a;
    size_[a] += size_[b];
    std::swap(next_[a], next_[b]);
    Members members{};
    if (size_[a] < 3 || size_[a] > members.size()) continue;
    std::uint32_t i = a;
    for (std::size_t k = 0; k < size_[a]; ++k, i = next_[i]) members[k] = i;
    const auto group = std::span(members).first(size_[a]);
    if (are_alike(group, kRingArea)) judge(group);
  }
}

/// Puts the ring whose LEDs are all of these lights, but for a lens, among the candidates.
void RingFinder::judge_whole(std::span<const std::uint32_t> group) {
  if (group.size() < kMinRingLeds) return;
  Members members{};
  std::copy(group.begin(), group.end(), members.begin());
  if (group.size() <= kMaxRingLeds) {
    const auto around = std::span(members).first(group.size());
    if (order_around(lights_, around)) {
      if (const auto ring = whole_ring(around)) candidates_.push_back(*ring);
      return;
    }
  }
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const std::uint32_t i : group) middle += place_of(lights_[i]);
  middle /= static_cast<double>(group.size());
  const auto off = [&](std::uint32_t i) { return (place_of(lights_[i]) - middle).squaredNorm(); };
  auto* const lens =
      std::min_element(members.data(), members.data() + group.size(),
                       [&](std::uint32_t a, std::uint32_t b) { return off(a) < off(b); });
  std::swap(*lens, members[group.size() - 1]);
  const auto around = std::span(members).first(group.size() - 1);
  if (around.size() < kMinRingLeds || !order_around(lights_, around)) return;
  const auto ring = whole_ring(around);
  const Eigen::Vector2d of_lens = place_of(lights_[members[group.size() - 1]]);
  if (ring && ring->view.place_near(of_lens).norm() < kMiddle) candidates_.push_back(*ring);
}

/// Puts the ring of which these lights are an arc among the candidates.
void RingFinder::judge_part(std::span<const std::uint32_t> group) {
  if (group.size() > kMaxRingLeds) return;
  Members members{};
  std::copy(group.begin(), group.end(), members.begin());
  const auto around = std::span(members).first(group.size());
  if (!order_around(lights_, around)) return;
  const auto ring = group.size() == 3 ? half_ring(around) : arc(around);
  if (ring) candidates_.push_back(*ring);
}

/// All LEDs of a board, in their order.
std::optional<Ring> RingFinder::whole_ring(std::span<const std::uint32_t> members) const {
  std::optional<Ring> best;
  const auto leds = members.size();
  for (const RingShape& shape : shapes_) {
    if (shape.places.size() != leds) continue;
    for (std::size_t shift = 0; shift < (shape.is_round() ? 1 : leds / 4); ++shift) {
      Ring ring{.leds = shape.leds(), .count = leds};
      std::copy(members.begin(), members.end(), ring.lights.begin());
      if (complete(ring, shape, shift) && (!best || ring.rms < best->rms)) best = ring;
    }
  }
  return best;
}

/// An arc of a board's LEDs, in their order, which begins after the longest gap or the second.
std::optional<Ring> RingFinder::arc(std::span<const std::uint32_t> members) const {
  if (members.size() <= kFew && !are_alike(members, kFewArea)) return std::nullopt;
  struct Gap {
    double length = 0.0;
    std::size_t after = 0;
  };
  std::array<Gap, 2> gaps{};
  for (std::size_t k = 0; k < members.size(); ++k) {
    const std::size_t after = (k + 1) % members.size();
    const double length =
        (place_of(lights_[members[after]]) - place_of(lights_[members[k]])).norm();
    if (length > gaps[0].length) {
      gaps = {Gap{length, after}, gaps[0]};
    } else if (length > gaps[1].length) {
      gaps[1] = {length, after};
    }
  }
  std::optional<Ring> best;
  for (const Gap& gap : gaps) {
    const auto ring = arc_after(members, gap.after);
    if (ring && (!best || ring->count > best->count ||
                 (ring->count == best->count && ring->rms < best->rms)))
      best = ring;
  }
  return best;
}

/// The best arc of any shape that begins with members[first].
std::optional<Ring> RingFinder::arc_after(std::span<const std::uint32_t> members,
                                          std::size_t first) const {
  const std::size_t count = members.size();
  Points seen;
  std::array<std::uint32_t, kMaxRingLeds> lights{};
  for (std::size_t k = 0; k < count; ++k) {
    lights[k] = members[(first + k) % count];
    seen[k] = place_of(lights_[lights[k]]);
  }
  const RingShape* best = nullptr;
  std::size_t best_shift = 0;
  double best_rms = 1e9;
  for (const RingShape& shape : shapes_) {
    const std::size_t leds = shape.places.size();
    if (leds <= count || leds > 2 * count) continue;
    for (std::size_t shift = 0; shift < (shape.is_round() ? 1 : leds / 4); ++shift) {
      Points places;
      for (std::size_t k = 0; k < count; ++k) places[k] = shape.places[(shift + k) % leds];
      const auto view = fit_from_afar(std::span(seen).first(count), std::span(places).first(count));
      if (!view || view->roundness() < kMinRoundness) continue;
      const double rms = view->rms(std::span(seen).first(count), std::span(places).first(count));
      if (rms >= best_rms) continue;
      best = &shape;
      best_shift = shift;
      best_rms = rms;
    }
  }
  if (best == nullptr) return std::nullopt;
  Ring ring{.leds = best->leds(), .lights = lights, .count = count};
  return complete(ring, *best, best_shift) ? std::optional(ring) : std::nullopt;
}

/// Fits the lights as the LEDs from `shift` on, and searches the other LEDs. False if the fit is
/// poor, or if the place of another LED is lit by something that is not an LED.
bool RingFinder::complete(Ring& ring, const RingShape& shape, std::size_t shift) const {
  const std::size_t leds = shape.places.size();
  Points seen;
  Points places;
  for (std::size_t k = 0; k < ring.count; ++k) {
    seen[k] = place_of(lights_[ring.lights[k]]);
    places[k] = shape.places[(shift + k) % leds];
  }
  const auto fit = [&] {
    const auto s = std::span(seen).first(ring.count);
    const auto p = std::span(places).first(ring.count);
    const auto from_afar = fit_from_afar(s, p);
    if (!from_afar || from_afar->roundness() < kMinRoundness) return false;
    const double radius = from_afar->radius();
    if (from_afar->rms(s, p) > tolerance(radius) + kPerspective * radius * radius) return false;
    const auto view = fit_perspective(*from_afar, s, p);
    if (!view || view->slant.norm() > kPerspective * radius) return false;
    ring.view = *view;
    ring.rms = view->rms(s, p);
    return ring.rms <= tolerance(radius);
  };
  if (!fit()) return false;
  const auto lookup = [&](std::size_t led) -> std::optional<std::uint32_t> {
    const Eigen::Vector2d& place = shape.places[led];
    const Eigen::Vector2d uv = ring.view.at(place);
    const double spacing = (ring.view.at(shape.places[(led + 1) % leds]) - uv).norm();
    const double reach = std::max(1.0, kReach * spacing);
    auto it = std::partition_point(order_.begin(), order_.end(),
                                   [&](std::uint32_t i) { return lights_[i].u < uv.x() - reach; });
    for (; it != order_.end() && lights_[*it].u <= uv.x() + reach; ++it) {
      const std::array pair{ring.lights[0], *it};
      if ((place_of(lights_[*it]) - uv).norm() > reach || !are_alike(pair, kRingArea)) continue;
      const auto members = ring.members();
      if (std::find(members.begin(), members.end(), *it) == members.end()) return *it;
    }
    return std::nullopt;
  };
  // From both ends of the arc.
  const std::size_t arc = ring.count;
  for (std::size_t k = 0; k < leds - arc; ++k) {
    const std::size_t step = k % 2 == 0 ? arc + k / 2 : leds - 1 - k / 2;
    const std::size_t led = (shift + step) % leds;
    if (const auto light = lookup(led)) {
      ring.lights[ring.count] = *light;
      seen[ring.count] = place_of(lights_[*light]);
      places[ring.count] = shape.places[led];
      ++ring.count;
      if (!fit()) return false;
    } else if (is_lit(ring.view.at(shape.places[led]))) {
      return false;
    }
  }
  return 2 * ring.count >= leds;
}

/// Three lights a, b, c of a regular hexagon have its center at a + c - b.
std::optional<Ring> RingFinder::half_ring(std::span<const std::uint32_t> members) const {
  std::optional<Ring> best;
  double widest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::array lights{members[k], members[(k + 1) % 3], members[(k + 2) % 3]};
    const Light& corner = lights_[lights[1]];
    const Eigen::Vector2d ba = place_of(lights_[lights[0]]) - place_of(corner);
    const Eigen::Vector2d bc = place_of(lights_[lights[2]]) - place_of(corner);
    const double shorter = std::min(ba.norm(), bc.norm());
    const double longer = std::max(ba.norm(), bc.norm());
    const double cosine = ba.dot(bc) / (shorter * longer);
    const bool is_one_blob = std::all_of(lights.begin(), lights.end(), [&](std::uint32_t i) {
      return lights_[i].blob == corner.blob;
    });
    const HalfRing& form = is_one_blob ? kOneBlob : kThreeBlobs;
    if (longer > form.spacing_tolerance * shorter || cosine < form.min_cosine ||
        cosine > form.max_cosine || -cosine < widest)
      continue;
    if (is_one_blob ? shorter < kHalfMinSpacing
                    : longer > kFarSpacing || !are_leds(lights) || !are_alike(lights, kHalfArea))
      continue;
    widest = -cosine;
    Points seen;
    Points places;
    const RingShape& six = *std::find_if(shapes_.begin(), shapes_.end(),
                                         [](const RingShape& s) { return s.leds() == 6; });
    for (std::size_t i = 0; i < 3; ++i) {
      seen[i] = place_of(lights_[lights[i]]);
      places[i] = six.places[i];
    }
    const auto view = fit_from_afar(std::span(seen).first(3), std::span(places).first(3));
    if (!view) continue;
    best = Ring{.view = *view, .leds = 6, .count = 3};
    std::copy(lights.begin(), lights.end(), best->lights.begin());
    for (std::size_t led = 3; led < 6; ++led)
      if (is_lit(view->at(six.places[led]))) best.reset();
    if (!best) return std::nullopt;
  }
  return best;
}

bool RingFinder::are_alike(std::span<const std::uint32_t> members, double factor) const {
  std::int32_t least = lights_[members[0]].area;
  std::int32_t most = least;
  for (const std::uint32_t i : members) {
    least = std::min(least, lights_[i].area);
    most = std::max(most, lights_[i].area);
  }
  return most <= factor * least;
}

bool RingFinder::are_leds(std::span<const std::uint32_t> members) const {
  return std::all_of(members.begin(), members.end(), [&](std::uint32_t i) {
    return lights_[i].peak >= kLedPeak && lights_[i].area >= kLedArea;
  });
}

bool RingFinder::is_lit(const Eigen::Vector2d& uv) const {
  const auto u = static_cast<int>(std::lround(uv.x()));
  const auto v = static_cast<int>(std::lround(uv.y()));
  return u >= 0 && v >= 0 && u < image_->width && v < image_->height &&
         image_->row(v)[u] >= threshold_;
}

/// Whether no free light could form a larger ring with these.
bool RingFinder::is_alone(const Ring& ring) const {
  const double reach = kAlone * ring.view.radius();
  const auto members = ring.members();
  auto it = std::partition_point(order_.begin(), order_.end(), [&](std::uint32_t i) {
    return lights_[i].u < ring.view.center.x() - reach;
  });
  for (; it != order_.end() && lights_[*it].u <= ring.view.center.x() + reach; ++it) {
    if (is_taken_[*it] != 0) continue;
    const double off = ring.view.place_near(place_of(lights_[*it])).norm();
    if (off > kAlone || off < kMiddle) continue;
    if (std::find(members.begin(), members.end(), *it) == members.end()) return false;
  }
  return true;
}

/// Whether a ring of few lights, or an arc, has enough evidence to be accepted.
bool RingFinder::is_credible(const Ring& ring) const {
  if (ring.is_whole() && ring.count > kFew) return true;
  const double radius = ring.view.radius();
  return ring.rms <= kFewRms * tolerance(radius) &&
         (radius <= kFarRadius || are_leds(ring.members())) &&
         (ring.count > kFew || is_alone(ring));
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
