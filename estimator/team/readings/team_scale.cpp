#include "estimator/team/readings/team_scale.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr double kOneOfLate = 0.35;  // a range within the agreement's memory

/// Whether ranges to this robot came of late, and agree.
bool has_range(const TeamBelief& belief, RobotId id) {
  return std::ranges::any_of(belief.ranges, [&](const auto& entry) {
    const auto& [pair, range] = entry;
    if (pair.first != id && pair.second != id) return false;
    return std::ranges::any_of(range.agreement, [](const auto& observed) {
      const Agreement& agreement = observed.second;
      return agreement.fused > std::max(kOneOfLate, agreement.gated);
    });
  });
}

}  // namespace

TeamScale::TeamScale(const TeamBelief& belief, const std::vector<bool>& corrected)
    : by_states(Eigen::VectorXd::Zero(std::ssize(corrected))) {
  double sum_m2 = 0.0;
  for (const auto& [id, robot] : belief.robots) {
    const int index = robot.motion_index;
    if (index < 0 || !corrected[static_cast<std::size_t>(index)] || !has_range(belief, id))
      continue;
    by_states.segment<3>(index) = robot.motion.p_F;
    sum_m2 += robot.motion.p_F.squaredNorm();
    ++count;
  }
  if (sum_m2 > 0.0) by_states /= sum_m2;
}

}  // namespace crepes
