#include "tests/study/rendered_spots.hpp"

namespace crepes::study {

RenderedSpots::RenderedSpots(const SimWorld& world, const Config& config, const LedBoard& board)
    : camera_(CameraModel::from(config.cameras.front().calibration).value()),
      ring_(RingRenderer::make(world, config.robot.id, config.swarm,
                               config.cameras.front().calibration, 0)
                .value()),
      renderer_(camera_, {},
                100 * static_cast<std::uint64_t>(world.seed()) + config.robot.id.value),
      detector_(config.vision) {
  for (const MemberConfig& member : config.swarm.members) {
    if (member.id == config.robot.id) continue;
    const Pose T_N_M{member.p_body_led, Eigen::Quaterniond::Identity()};
    renderer_.add({board,
                   [this, &world, self = config.robot.id, neighbor = member.id, T_N_M](double t_s) {
                     return ring_.T_C_B() * world.T_B_N(self, neighbor, t_s) * T_N_M;
                   },
                   [this, neighbor = member.id](double) { return lit_.contains(neighbor); }});
  }
}

std::vector<Spot> RenderedSpots::at(double t_s) {
  lit_.clear();
  for (const RingRenderer::View& view : ring_.views(t_s)) lit_.insert(view.robot);
  const std::vector<std::uint8_t>& pixels = renderer_.render(t_s);
  const Detection found =
      detector_.detect({pixels.data(), camera_.width(), camera_.height(), camera_.width()});
  return {found.spots.begin(), found.spots.end()};
}

}  // namespace crepes::study
