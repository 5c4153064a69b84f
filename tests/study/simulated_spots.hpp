/// What a spot detector finds in the pictures of a simulated camera, without the pictures.
#pragma once

#include <cstdint>
#include <vector>

#include "config/schema/config.hpp"
#include "drivers/sim/ring_renderer.hpp"
#include "drivers/sim/seeded_noise.hpp"
#include "tests/study/obstacles.hpp"

namespace crepes::study {

/// A time without light.
struct Darkness {
  double from_s = 0.0;
  double to_s = 0.0;
  RobotId robot{};  ///< nobody sees this robot, and it sees nobody; 0: nobody sees anything

  /// Whether nobody sees this robot then, and it sees nobody.
  [[nodiscard]] bool covers(RobotId id, double t_s) const {
    return t_s >= from_s && t_s < to_s && (robot == RobotId{} || robot == id);
  }
};

/// What disturbs a camera beside its own noise.
struct Disturbance {
  bool interference = false;  ///< glints, mains lamps, mirror images in the floor
  ObstacleField obstacles{Obstacles::kNone, 0};
  bool hides_images = true;  ///< what hides a robot hides its image, too
  Darkness dark;
  double sight_m = 1e3;  ///< no spot of boards beyond
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
