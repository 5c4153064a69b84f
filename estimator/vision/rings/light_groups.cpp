#include "estimator/vision/rings/light_groups.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace crepes {
namespace {

constexpr std::size_t kNeighbors = 4;
constexpr double kMaxSpacing = 110.0;  // px between LEDs: four of a board of 12 cm at 0.4 m
constexpr double kMinSpacing = 2.5;    // px; closer ones are one light
constexpr double kSimilarArea = 4.0;   // of linked lights

}  // namespace

LightGroups::LightGroups() {
  links_.reserve(LightField::kMaxLights * kNeighbors);
  near_.reserve(LightField::kMaxLights);
  parent_.reserve(LightField::kMaxLights);
  next_.reserve(LightField::kMaxLights);
  size_.reserve(LightField::kMaxLights);
}

void LightGroups::link_nearest(const LightField& field) {
  links_.clear();
  near_.resize(field.size());
  const auto order = field.by_column();
  for (std::size_t place = 0; place < order.size(); ++place) {
    const std::uint32_t a = order[place];
    std::array<Link, kNeighbors> near{};
    near.fill({kMaxSpacing, a, a});
    const auto consider = [&](std::uint32_t b) {
      const double du = field[b].u - field[a].u;
      const double dv = field[b].v - field[a].v;
      if (std::abs(du) >= near.back().length) return false;
      if (std::abs(dv) >= near.back().length) return true;
      const double squared = du * du + dv * dv;
      if (squared < kMinSpacing * kMinSpacing ||
          squared >= near.back().length * near.back().length ||
          std::max(field[a].area, field[b].area) >
              kSimilarArea * std::min(field[a].area, field[b].area))
        return true;
      const double length = std::sqrt(squared);
      std::size_t k = kNeighbors - 1;
      for (; k > 0 && near[k - 1].length > length; --k) near[k] = near[k - 1];
      near[k] = {length, a, b};
      return true;
    };
    for (std::size_t j = place + 1; j < order.size() && consider(order[j]); ++j) {
    }
    for (std::size_t j = place; j > 0 && consider(order[j - 1]); --j) {
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

void LightGroups::restart() {
  const auto count = static_cast<std::uint32_t>(near_.size());
  parent_.resize(count);
  next_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) parent_[i] = next_[i] = i;
  size_.assign(count, 1);
  next_link_ = 0;
}

std::uint32_t LightGroups::root_of(std::uint32_t i) {
  while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
  return i;
}

std::optional<std::span<const std::uint32_t>> LightGroups::next(
    const LightField& field, std::span<const std::uint8_t> is_taken) {
  while (next_link_ < links_.size()) {
    const Link& link = links_[next_link_++];
    if (is_taken[link.a] != 0 || is_taken[link.b] != 0) continue;
    const std::uint32_t a = root_of(link.a);
    const std::uint32_t b = root_of(link.b);
    if (a == b) continue;
    parent_[b] = a;
    size_[a] += size_[b];
    std::swap(next_[a], next_[b]);
    if (size_[a] < 3 || size_[a] > kMaxMembers) continue;
    std::uint32_t i = a;
    for (std::size_t k = 0; k < size_[a]; ++k, i = next_[i]) members_[k] = i;
    const auto group = std::span<const std::uint32_t>(members_).first(size_[a]);
    if (field.are_alike(group, LightField::kRingArea)) return group;
  }
  return std::nullopt;
}

}  // namespace crepes
