#include "daemon/ctl/dataset/recorded_manifest.hpp"

#include <algorithm>

#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

std::string name_of(const SwarmConfig& swarm, RobotId id) {
  const auto member = std::ranges::find(swarm.members, id, &MemberConfig::id);
  return member == swarm.members.end() ? "" : member->name;
}

}  // namespace

std::string own_robot_name(const Config& config) { return name_of(config.swarm, config.robot.id); }

std::string recorded_manifest(const Config& config, const std::string& dir, Timestamp first,
                              Timestamp last, const std::vector<client::Status::Clock>& clocks) {
  const RobotClock own{to_seconds(first.time_since_epoch()), 0.0};
  SwarmManifest manifest;
  manifest.scenario = "recorded";
  manifest.duration_s = to_seconds(last - first);
  manifest.network = {.latency_ms = 3.0, .jitter_ms = 3.0, .loss = 0.0, .seed = 1};
  manifest.robots = {
      {.id = config.robot.id, .name = own_robot_name(config), .dir = dir, .clock = own}};
  std::string text =
      "# One robot, as crepesctl record wrote it. True time is its own clock, from its first\n"
      "# measurement on. The network was not recorded: latency, jitter and loss are assumptions.\n"
      "# To replay it with others, put their folders beside this one's and list them here. "
      "`clock`\n"
      "# of another robot: offset_s is its clock minus this one's, plus this one's offset_s.\n" +
      manifest_text(manifest);
  std::string peers;
  for (const client::Status::Clock& clock : clocks) {
    if (!clock.skew_ppm) continue;
    // local = true (1 + skew) + offset, and at `last` local = last + clock.offset_s.
    const double turned_s = manifest.duration_s * *clock.skew_ppm * 1e-6;
    const RobotClock peer{own.offset_s + clock.offset_s - turned_s, *clock.skew_ppm};
    const std::string name = name_of(config.swarm, RobotId{clock.peer});
    peers +=
        "# " + robot_text({.id = RobotId{clock.peer}, .name = name, .dir = name, .clock = peer});
  }
  if (peers.empty()) return text;
  return text +
         "# As this robot knew its peers' clocks; uncomment each robot whose folder is here:\n" +
         peers;
}

}  // namespace crepes
