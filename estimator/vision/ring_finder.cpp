#include "estimator/vision/ring_finder.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace crepes {
namespace {

constexpr std::size_t kMaxBlobs = 1024;  // more is a scene of lights, searched for no rings
constexpr std::size_t kNeighbors = 4;
constexpr double kMaxSpacing = 60.0;  // px between LEDs: the ring at 0.3 m
constexpr double kMinSpacing = 3.0;   // px; closer ones are one blob
constexpr double kSimilarArea = 4.0;
constexpr double kCenterTolerance = 0.15;  // of the ring's radius
constexpr double kMaxCornerCosine = -0.1;
constexpr double kSpacingTolerance = 2.2;  // longer to shorter side, as a tilted ring shows

}  // namespace

void absorb(Blob& whole, Blob& part) {
  whole.weight += part.weight;
  whole.u += part.u;
  whole.v += part.v;
  whole.uu += part.uu;
  whole.uv += part.uv;
  whole.vv += part.vv;
  whole.area += part.area;
  whole.u_min = std::min(whole.u_min, part.u_min);
  whole.u_max = std::max(whole.u_max, part.u_max);
  whole.v_min = std::min(whole.v_min, part.v_min);
  whole.v_max = std::max(whole.v_max, part.v_max);
  whole.peak = std::max(whole.peak, part.peak);
  part.is_part = true;
}

void RingFinder::join(std::vector<Blob>& blobs) {
  order_.clear();
  for (std::uint32_t i = 0; i < blobs.size(); ++i)
    if (!blobs[i].is_part && blobs[i].area > 1) order_.push_back(i);
  if (order_.size() < 4 || order_.size() > kMaxBlobs) return;
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return blobs[a].mean_u() < blobs[b].mean_u();
  });

  votes_.clear();
  struct Neighbor {
    double distance = 1e9;
    std::uint32_t blob = 0;
  };
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Blob& b = blobs[order_[i]];
    std::array<Neighbor, kNeighbors> near{};
    const auto consider = [&](std::size_t j) {
      const Blob& other = blobs[order_[j]];
      const double du = other.mean_u() - b.mean_u();
      if (std::abs(du) > kMaxSpacing) return false;
      const double distance = std::hypot(du, other.mean_v() - b.mean_v());
      const double ratio = static_cast<double>(other.area) / b.area;
      if (distance < kMinSpacing || distance > kMaxSpacing || ratio > kSimilarArea ||
          ratio * kSimilarArea < 1.0 || distance >= near.back().distance)
        return true;
      near.back() = {distance, order_[j]};
      std::sort(near.begin(), near.end(),
                [](const Neighbor& x, const Neighbor& y) { return x.distance < y.distance; });
      return true;
    };
    for (std::size_t j = i + 1; j < order_.size() && consider(j); ++j) {
    }
    for (std::size_t j = i; j > 0 && consider(j - 1); --j) {
    }
    for (std::size_t a = 0; a < kNeighbors; ++a) {
      for (std::size_t c = a + 1; c < kNeighbors; ++c) {
        if (near[c].distance > kSpacingTolerance * near[a].distance) continue;
        const Blob& first = blobs[near[a].blob];
        const Blob& last = blobs[near[c].blob];
        // The corner at b is 120 degrees, less when the ring is tilted.
        const double dot = (first.mean_u() - b.mean_u()) * (last.mean_u() - b.mean_u()) +
                           (first.mean_v() - b.mean_v()) * (last.mean_v() - b.mean_v());
        if (dot > kMaxCornerCosine * near[a].distance * near[c].distance) continue;
        const double u = first.mean_u() + last.mean_u() - b.mean_u();
        const double v = first.mean_v() + last.mean_v() - b.mean_v();
        votes_.push_back({u,
                          v,
                          std::hypot(u - b.mean_u(), v - b.mean_v()),
                          {near[a].blob, order_[i], near[c].blob}});
      }
    }
  }
  std::sort(votes_.begin(), votes_.end(), [](const Vote& a, const Vote& b) { return a.u < b.u; });

  // The ring that most blobs agree on first; a blob belongs to one ring.
  for (std::size_t least = 6; least >= 4; --least) {
    for (std::size_t i = 0; i < votes_.size(); ++i) {
      const Vote& seed = votes_[i];
      const double tolerance = kCenterTolerance * seed.radius;
      std::array<std::uint32_t, 6> members{};
      std::size_t count = 0;
      std::size_t agreeing = 0;
      double u = 0.0;
      double v = 0.0;
      const auto include = [&](const Vote& vote) {
        if (std::abs(vote.v - seed.v) > tolerance ||
            vote.radius > kSpacingTolerance * seed.radius ||
            seed.radius > kSpacingTolerance * vote.radius)
          return;
        if (std::any_of(std::begin(vote.members), std::end(vote.members),
                        [&](std::uint32_t m) { return blobs[m].is_part || blobs[m].has_center; }))
          return;
        for (const std::uint32_t m : vote.members) {
          if (std::find(members.begin(), members.begin() + count, m) == members.begin() + count) {
            if (count == members.size()) return;
            members[count++] = m;
          }
        }
        u += vote.u;
        v += vote.v;
        ++agreeing;
      };
      for (std::size_t j = i; j > 0 && seed.u - votes_[j - 1].u <= tolerance; --j)
        include(votes_[j - 1]);
      for (std::size_t j = i; j < votes_.size() && votes_[j].u - seed.u <= tolerance; ++j)
        include(votes_[j]);
      if (count < least || agreeing + 2 < count) continue;
      Blob& whole = blobs[members[0]];
      for (std::size_t m = 1; m < count; ++m) absorb(whole, blobs[members[m]]);
      whole.has_center = true;
      whole.center_u = u / static_cast<double>(agreeing);
      whole.center_v = v / static_cast<double>(agreeing);
    }
  }
}

}  // namespace crepes
