/// What a spot detector finds in the pictures of a simulated camera, without the pictures.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/sim/ring_renderer.hpp"
#include "drivers/sim/seeded_noise.hpp"

namespace crepes::study {

/// One robot's first camera: noise that grows with distance, drop-outs, spots that merge; with
/// interference also glints, lamps on the mains and mirror images in the floor.
class SimulatedSpots {
 public:
  /// `world` must outlive this.
  SimulatedSpots(const SimWorld& world, const Config& config, bool interference);

  [[nodiscard]] std::vector<Spot> at(double t_s);

 private:
  void add_mirror_images(const std::vector<RingRenderer::View>& views, double t_s,
                         std::vector<Spot>& spots);
  void add_lights(double t_s, std::vector<Spot>& spots);
  void add(Spot spot, double sigma_px, std::vector<Spot>& spots);

  const SimWorld& world_;
  RobotId self_;
  std::vector<MemberConfig> members_;
  RingRenderer renderer_;
  bool interference_;
  SeededNoise noise_;
  std::uint64_t drawn_ = 0;
};

}  // namespace crepes::study
