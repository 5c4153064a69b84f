/// What a spot detector finds in the pictures of a simulated camera, without the pictures.
#pragma once

#include <cstdint>
#include <vector>

#include "config/schema/config.hpp"
#include "drivers/sim/ring_renderer.hpp"
#include "drivers/sim/seeded_noise.hpp"
#include "tests/study/obstacles.hpp"

namespace crepes::study {

/// What disturbs a camera beside its own noise.
struct Disturbance {
  bool interference = false;  ///< glints, mains lamps, mirror images in the floor
  ObstacleField obstacles{Obstacles::kNone, 0};
  bool hides_images = true;  ///< what hides a robot hides its image, too
  double dark_from_s = 0.0;  ///< no spot from here
  double dark_to_s = 0.0;    ///< to here
  double sight_m = 1e3;      ///< no spot of boards beyond
  RobotId covered{};         ///< nobody sees this robot, and it sees nobody; 0: no such robot
};

/// One robot's first camera: noise that grows with distance, drop-outs, spots that merge; with
/// interference also glints, lamps on the mains and mirror images in the floor.
class SimulatedSpots {
 public:
  /// `world` must outlive this.
  SimulatedSpots(const SimWorld& world, const Config& config, Disturbance disturbance);

  [[nodiscard]] std::vector<Spot> at(double t_s);

 private:
  [[nodiscard]] bool is_hidden(RobotId neighbor, double t_s) const;
  void add_mirror_images(const std::vector<RingRenderer::View>& views, double t_s,
                         std::vector<Spot>& spots);
  void add_lights(double t_s, std::vector<Spot>& spots);
  void add(Spot spot, double sigma_px, std::vector<Spot>& spots);

  const SimWorld& world_;
  RobotId self_;
  std::vector<MemberConfig> members_;
  RingRenderer renderer_;
  Eigen::Vector3d p_B_C_;
  Disturbance disturbance_;
  SeededNoise noise_;
  std::uint64_t drawn_ = 0;
};

}  // namespace crepes::study
