#include "estimator/swarm/settings_change.hpp"

#include <algorithm>
#include <tuple>
#include <vector>

#include "estimator/swarm/filter_settings.hpp"

namespace crepes {
namespace {

/// The same robots without their names, which no filter uses.
std::vector<MemberConfig> unnamed(std::vector<MemberConfig> members) {
  for (MemberConfig& member : members) member.name.clear();
  return members;
}

/// What the tracks of lights depend on.
SwarmConfig as_seen(SwarmConfig swarm) {
  for (MemberConfig& member : swarm.members) {
    member.name.clear();
    member.uwb_id.reset();
    member.range_delay_m = 0.0;
    member.p_body_led = member.p_body_uwb = Eigen::Vector3d::Zero();
  }
  return swarm;
}

/// Whether LEDs, antenna or module of a robot that is a member of both are others.
bool is_mounted_otherwise(const SwarmConfig& before, const SwarmConfig& now) {
  const auto mounting = [](const MemberConfig& member) {
    return std::tuple(member.p_body_led, member.p_body_uwb, member.range_delay_m, member.uwb_id);
  };
  return std::ranges::any_of(before.members, [&](const MemberConfig& was) {
    const auto is = std::ranges::find(now.members, was.id, &MemberConfig::id);
    return is != now.members.end() && mounting(*is) != mounting(was);
  });
}

/// All of them if this robot itself is another.
std::set<RobotId> changed_neighbors(const EstimatorSettings& before, const EstimatorSettings& now) {
  const std::vector<MemberConfig> were = unnamed(before.swarm.members);
  const std::vector<MemberConfig> are = unnamed(now.swarm.members);
  const auto is_changed = [&](const MemberConfig& was) {
    return std::ranges::count(are, was) == 0;
  };
  const auto own = std::ranges::find(were, before.self, &MemberConfig::id);
  const bool is_own_changed = own == were.end() || is_changed(*own);
  std::set<RobotId> changed;
  for (const MemberConfig& was : were)
    if (was.id != before.self && (is_own_changed || is_changed(was))) changed.insert(was.id);
  return changed;
}

}  // namespace

SettingsChange change_between(const EstimatorSettings& before, const EstimatorSettings& now) {
  // What the team has learned of a module holds no longer after a calibration.
  return {.restarts_tracks =
              !(before.vision == now.vision && as_seen(before.swarm) == as_seen(now.swarm)),
          .restarts_team = is_mounted_otherwise(before.swarm, now.swarm) ||
                           !(filter_settings(before).priors == filter_settings(now).priors),
          .restarts_neighbors = changed_neighbors(before, now)};
}

}  // namespace crepes
