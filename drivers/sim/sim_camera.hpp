/// A simulated camera.
#pragma once

#include <cstdint>

#include "drivers/camera/camera.hpp"
#include "drivers/sim/ring_renderer.hpp"
#include "drivers/sim/sim_clock.hpp"

namespace crepes {

/// Renders images of the world at a steady rate, stamped with the exposure time on the robot's
/// clock. If the reader falls behind, frames are missed, not queued.
class SimCamera final : public Camera {
 public:
  /// `clock` must outlive this.
  SimCamera(RingRenderer renderer, const CameraCalibration& config, const SimClock& clock);

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds timeout) override;
  void recycle(Frame frame) override { renderer_.recycle(std::move(frame)); }
  /// LEDs are as bright as the light: 500 us at 0 dB is what is simulated without settings.
  [[nodiscard]] Result<void> set_light(const CameraLight& light) override;
  [[nodiscard]] SensorTotals counters() const override;

 private:
  RingRenderer renderer_;
  const SimClock& clock_;
  double rate_hz_;
  Duration timeshift_;
  std::int64_t next_;  ///< counts frames since the world's epoch
  std::uint64_t frames_ = 0;
  std::uint64_t superseded_ = 0;
};

}  // namespace crepes
