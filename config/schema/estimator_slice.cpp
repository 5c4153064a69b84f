#include "config/schema/estimator_slice.hpp"

#include "config/schema/mesh_slice.hpp"

namespace crepes {

EstimatorSettings estimator_settings(const Config& config) {
  EstimatorSettings settings{.self = config.robot.id,
                             .swarm = config.swarm,
                             .cameras = {},
                             .imu = config.imu.noise,
                             .range = config.uwb.noise,
                             .vision = config.vision,
                             .filters = config.estimator,
                             .report_rate_hz = report_rate_hz(config),
                             .solves_graph = config.graph.enabled,
                             .graph_rate_hz = config.graph.rate_hz,
                             .uses_team_filter = config.graph.method == TeamMethod::kTeamFilter,
                             .team_size = static_cast<std::size_t>(config.graph.team_size)};
  for (MemberConfig& member : settings.swarm.members) {
    member.public_key.reset();  // estimation does not depend on who may speak
    member.excluded = false;
  }
  for (const CameraConfig& camera : config.cameras) settings.cameras.push_back(camera.calibration);
  return settings;
}

}  // namespace crepes
