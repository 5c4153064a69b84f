#include "estimator/team/trust/witnesses.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr double kExplained = 4.0;  // sigmas of a distance by which it may be wrong

/// Whether another camera than `observer`'s contradicts the place of `id`.
bool others_contradict(const TeamBelief& belief, RobotId observer, RobotId id) {
  const auto all =
      witnesses_of(belief, [&](RobotId witness, const TeamCamera&) { return witness == observer; });
  const auto found = all.find(id);
  return found != all.end() && found->second.contradict > 0.0;
}

/// It contradicts most of the robots that it sees, at least two since one may itself be in the
/// wrong place.
bool contradicts_most(const TeamCamera& camera) {
  const auto seen = std::ranges::count_if(camera.agreement, [](const auto& entry) {
    return entry.second.fused + entry.second.gated > 1.0;
  });
  const auto contradicted = std::ranges::count_if(
      camera.agreement, [](const auto& entry) { return entry.second.is_contradiction(); });
  return contradicted >= 2 && 2 * contradicted > seen;
}

/// The rule for a camera that was found turned before. It contradicts a robot that no other camera
/// contradicts, of late more often than it agrees with all others: what it agreed with while it was
/// turned says nothing for it now.
bool contradicts_more(const TeamBelief& belief, RobotId observer, const TeamCamera& camera) {
  double agreed = 0.0;
  double contradicted = 0.0;
  for (const auto& [neighbor, agreement] : camera.agreement) {
    if (!agreement.is_contradiction()) {
      agreed += agreement.fused;
    } else if (!others_contradict(belief, observer, neighbor)) {
      contradicted += agreement.gated;
    }
  }
  return contradicted > agreed;
}

/// Whether the ranges that both robots of a pair measured are refused, and by no more than their
/// places may be wrong.
bool contradicts_place(const TeamBelief& belief, const RobotPair& pair,
                       const TeamRangeBias& range) {
  const auto [i, j] = pair;
  const Eigen::Vector3d u =
      (belief.robots.at(j).motion.p_F - belief.robots.at(i).motion.p_F).normalized();
  const double sigma_m = std::sqrt(u.dot(belief.position_covariance(i, j) * u));
  return range.agreement.size() == 2 &&
         std::ranges::all_of(range.agreement, [&](const auto& entry) {
           const auto& [observer, agreement] = entry;
           return agreement.gated > agreement.fused &&
                  std::abs(range.refused_m.at(observer)) < kExplained * sigma_m;
         });
}

}  // namespace

Witnesses witnesses_of(const TeamBelief& belief, const IsExcluded& is_excluded) {
  Witnesses witnesses;
  for (const auto& [id, robot] : belief.robots) {
    for (const TeamCamera& camera : robot.cameras) {
      if (camera.is_refused || is_excluded(id, camera)) continue;
      for (const auto& [neighbor, agreement] : camera.agreement) {
        Votes& of_neighbor = witnesses[neighbor];
        if (agreement.is_contradiction()) {
          of_neighbor.contradict += 1.0;
        } else if (agreement.fused > 1.0) {
          of_neighbor.agree += 1.0;
        }
      }
    }
  }
  return witnesses;
}

Witnesses bearings_of(const TeamBelief& belief) {
  Witnesses all;
  for (const auto& [id, robot] : belief.robots) {
    for (const TeamCamera& camera : robot.cameras) {
      for (const auto& [neighbor, agreement] : camera.agreement) {
        for (const RobotId end : {id, neighbor}) {
          all[end].agree += agreement.fused;
          all[end].contradict += agreement.gated;
        }
      }
    }
  }
  return all;
}

Agreement ranges_of(const TeamBelief& belief, RobotId id) {
  Agreement all;
  for (const auto& [pair, range] : belief.ranges) {
    if (pair.first != id && pair.second != id) continue;
    for (const auto& [observer, agreement] : range.agreement) {
      all.fused += agreement.fused;
      all.gated += agreement.gated;
    }
  }
  return all;
}

OwnRanges own_ranges_of(const TeamBelief& belief, RobotId id,
                        const std::function<bool(const RobotPair&)>& counts) {
  OwnRanges all;
  for (const auto& [pair, range] : belief.ranges) {
    const auto agreement = range.agreement.find(id);
    if (agreement == range.agreement.end() || !counts(pair)) continue;
    all.measured += agreement->second.fused + agreement->second.gated > 1.0 ? 1 : 0;
    if (!agreement->second.is_contradiction()) continue;
    ++all.contradicted;
    if (const auto refused = range.refused_m.find(id); refused != range.refused_m.end())
      all.sum_m += refused->second;
  }
  return all;
}

bool looks_turned(const TeamBelief& belief, RobotId observer, const TeamCamera& camera,
                  bool was_turned) {
  if (!contradicts_most(camera) && !(was_turned && contradicts_more(belief, observer, camera)))
    return false;
  const auto all = witnesses_of(belief, [](RobotId, const TeamCamera&) { return false; });
  const auto of_observer = all.find(observer);
  return of_observer == all.end() || of_observer->second.contradict == 0.0;
}

bool is_alone(const TeamBelief& belief, RobotId observer, const TeamCamera& camera) {
  const auto others =
      witnesses_of(belief, [&](RobotId witness, const TeamCamera&) { return witness == observer; });
  bool contradicts = false;
  for (const auto& [neighbor, agreement] : camera.agreement) {
    if (agreement.is_contradiction()) {
      contradicts = true;
      const auto found = others.find(neighbor);
      if (found == others.end() || found->second.agree == 0.0 || found->second.contradict > 0.0)
        return false;
    } else if (agreement.fused > 1.0) {
      return false;
    }
  }
  return contradicts;
}

bool is_contradicted(const TeamBelief& belief, const Witnesses& all, RobotId id) {
  const auto found = all.find(id);
  if (found == all.end() || found->second.contradict == 0.0) return false;
  const Votes& of_robot = found->second;
  const bool came_last = std::ranges::none_of(all, [&](const auto& other) {
    return other.second.contradict > 0.0 &&
           belief.robots.at(other.first).since > belief.robots.at(id).since;
  });
  return of_robot.contradict > of_robot.agree ||
         (of_robot.contradict == of_robot.agree && came_last);
}

bool is_misplaced(const TeamBelief& belief, RobotId id) {
  if (!ranges_of(belief, id).is_contradiction()) return false;
  int measured = 0;
  int contradicted = 0;
  for (const auto& [pair, range] : belief.ranges) {
    if (pair.first != id && pair.second != id) continue;
    double readings = 0.0;
    for (const auto& [observer, agreement] : range.agreement)
      readings += agreement.fused + agreement.gated;
    if (readings <= 1.0) continue;
    ++measured;
    contradicted += contradicts_place(belief, pair, range) ? 1 : 0;
  }
  return contradicted >= 2 && 2 * contradicted > measured;
}

bool is_placed_by_its_own_ranges(const TeamBelief& belief, RobotId id) {
  return std::ranges::any_of(belief.ranges, [&](const auto& entry) {
    const auto& [pair, range] = entry;
    if (pair.first != id && pair.second != id) return false;
    const RobotId other = pair.first == id ? pair.second : pair.first;
    const auto of_other = range.agreement.find(other);
    const auto own = range.agreement.find(id);
    return belief.robots.at(other).is_trusted && of_other != range.agreement.end() &&
           of_other->second.is_contradiction() && own != range.agreement.end() &&
           !own->second.is_contradiction() &&
           !own_ranges_of(belief, other, [](const RobotPair&) { return true; }).are_false();
  });
}

}  // namespace crepes
