/// What the spot detector finds in rendered pictures of a simulated camera.
#pragma once

#include <set>
#include <vector>

#include "config/schema/config.hpp"
#include "drivers/sim/board_renderer.hpp"
#include "drivers/sim/ring_renderer.hpp"
#include "estimator/vision/spot_detector.hpp"

namespace crepes::study {

/// One robot's first camera, every picture of it rendered with boards of the same make. Lens,
/// mounting, blinking and occlusion are those of `SimulatedSpots`; noise is the sensor's.
class RenderedSpots {
 public:
  /// `world` must outlive this.
  RenderedSpots(const SimWorld& world, const Config& config, const LedBoard& board);
  RenderedSpots(const RenderedSpots&) = delete;  // the pictures' boards refer to this
  RenderedSpots& operator=(const RenderedSpots&) = delete;

  [[nodiscard]] std::vector<Spot> at(double t_s);

 private:
  CameraModel camera_;
  RingRenderer ring_;
  BoardRenderer renderer_;
  SpotDetector detector_;
  std::set<RobotId> lit_;  ///< in the picture at hand
};

}  // namespace crepes::study
