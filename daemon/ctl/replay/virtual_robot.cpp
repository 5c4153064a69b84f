#include "daemon/ctl/replay/virtual_robot.hpp"

#include <fmt/core.h>

#include <utility>

#include "config/schema/estimator_slice.hpp"
#include "config/schema/mesh_slice.hpp"
#include "config/schema/validation.hpp"
#include "daemon/ctl/replay/swarm_replay.hpp"

namespace crepes {
namespace {

/// Those that are heard.
std::vector<RobotId> heard_ids(const Config& config) {
  std::vector<RobotId> ids;
  for (const MemberConfig& member : config.swarm.members)
    if (!member.excluded) ids.push_back(member.id);
  return ids;
}

}  // namespace

VirtualRobot::VirtualRobot(RobotRecording recorded, bool sealed)
    : recording(std::move(recorded)),
      estimator(estimator_settings(recording.config)),
      link(new_link()),
      detector(recording.config.vision) {
  if (!sealed) return;
  for (MemberConfig& member : recording.config.swarm.members)
    member.public_key = to_text(public_key_of(replay_robot_key(member.id)));
  recording.config.net.key_file = "the swarm's, of the replay";  // never read
  recording.config.net.robot_key_file = "its own, of the replay";
  seal.emplace(replay_swarm_key());
  signer.emplace(replay_robot_key(id()));
  trust = mesh_trust(recording.config);
  link.set_trust(trust);
}

PeerLink VirtualRobot::new_link() const {
  PeerLink fresh(id(), heard_ids(recording.config), send_settings(recording.config));
  fresh.set_trust(trust);
  return fresh;
}

void VirtualRobot::restart() {
  estimator = Estimator(estimator_settings(recording.config));
  team = TeamSolver();
  link = new_link();
  held.clear();
  handed = {};
}

Result<ConfigChange> VirtualRobot::reload(const Config& wanted) {
  ConfigChange change = plan_reload(recording.config, wanted);
  std::string faults;
  for (const RuleFault& fault : validate(change.config))
    faults += fmt::format("{}: {}\n", fault.key, fault.reason);
  if (!faults.empty()) return fail(ErrorCode::kConfig, faults);

  recording.config = change.config;
  estimator.reconfigure(estimator_settings(recording.config));
  trust = mesh_trust(recording.config);
  link.set_members(heard_ids(recording.config));
  link.set_trust(trust);
  link.set_pacing(send_settings(recording.config));
  return change;
}

double VirtualRobot::airtime(double duration_s) const {
  if (datagrams_sent == 0) return 0.0;
  const auto datagrams = static_cast<double>(datagrams_sent);
  return crepes::airtime(datagrams / duration_s, static_cast<double>(bytes_sent) / datagrams,
                         send_settings(recording.config).broadcasts);
}

}  // namespace crepes
