#include "tests/study/obstacles.hpp"

#include <algorithm>
#include <numbers>

#include "drivers/sim/seeded_noise.hpp"

namespace crepes::study {
namespace {

constexpr std::uint64_t kPillarKey = 0x70696c6cU;
constexpr double kPillarRadius = 0.15;   // m
constexpr double kPillarSpacing = 1.4;   // m; robots stay more than 2.4 m from the center
constexpr double kPillarScatter = 0.25;  // m
constexpr double kPostRadius = 0.08;     // m
constexpr double kPostSpacing = 0.3;     // m: half of the fence is open
constexpr int kPostsAside = 10;

std::vector<Pillar> thin_pillars(int seed) {
  const SeededNoise noise{kPillarKey, static_cast<std::uint64_t>(seed)};
  std::vector<Pillar> pillars;
  std::uint64_t drawn = 0;
  for (const int x : {-1, 0, 1}) {
    for (const int y : {-1, 0, 1}) {
      const Eigen::Vector2d scatter(2.0 * noise.uniform(drawn) - 1.0,
                                    2.0 * noise.uniform(drawn + 1) - 1.0);
      drawn += 2;
      pillars.push_back(
          {.center_W = kPillarSpacing * Eigen::Vector2d(x, y) + kPillarScatter * scatter,
           .radius_m = kPillarRadius});
    }
  }
  return pillars;
}

/// Along the diagonal: robots are on both sides.
std::vector<Pillar> fence() {
  std::vector<Pillar> posts;
  for (int i = -kPostsAside; i <= kPostsAside; ++i) {
    const double along = kPostSpacing * i / std::numbers::sqrt2;
    posts.push_back({.center_W = {along, along}, .radius_m = kPostRadius});
  }
  return posts;
}

std::vector<Pillar> pillars_of(Obstacles kind, int seed) {
  switch (kind) {
    case Obstacles::kNone:
      return {};
    case Obstacles::kThinPillars:
      return thin_pillars(seed);
    case Obstacles::kFence:
      return fence();
  }
  return {};
}

}  // namespace

ObstacleField::ObstacleField(Obstacles kind, int seed)
    : radio_passes_(kind == Obstacles::kFence), pillars_(pillars_of(kind, seed)) {}

bool ObstacleField::blocks_light(const Eigen::Vector3d& p_W_from,
                                 const Eigen::Vector3d& p_W_to) const {
  const Eigen::Vector2d along = (p_W_to - p_W_from).head<2>();
  const double length_sq = along.squaredNorm();
  return std::any_of(pillars_.begin(), pillars_.end(), [&](const Pillar& pillar) {
    const Eigen::Vector2d start = p_W_from.head<2>() - pillar.center_W;
    const double nearest =
        length_sq > 0.0 ? std::clamp(-start.dot(along) / length_sq, 0.0, 1.0) : 0.0;
    return (start + nearest * along).norm() < pillar.radius_m;
  });
}

bool ObstacleField::blocks_radio(const Eigen::Vector3d& p_W_from,
                                 const Eigen::Vector3d& p_W_to) const {
  return !radio_passes_ && blocks_light(p_W_from, p_W_to);
}

}  // namespace crepes::study
