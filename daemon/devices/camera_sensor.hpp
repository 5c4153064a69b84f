/// A camera as a sensor.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daemon/devices/sensor.hpp"
#include "daemon/stages/bounded_queue.hpp"
#include "daemon/stages/live_settings.hpp"
#include "drivers/camera/camera.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

using FrameQueue = BoundedQueue<Frame>;
using OpenCamera = std::function<Result<std::unique_ptr<Camera>>(const CameraLight&)>;

/// A camera's light: the main thread changes the settings, the vision thread the exposure where
/// that is automatic, the camera's thread follows.
class LiveLight {
 public:
  explicit LiveLight(const LightSettings& initial) : settings_(initial) {}

  /// For the main thread.
  void update(const LightSettings& wanted) { settings_.update(wanted); }
  /// For the vision thread. Without effect on an exposure that is fixed.
  void expose(double exposure_us) { exposures_us_.push(exposure_us); }

  /// For the camera's thread, as is the rest.
  [[nodiscard]] bool has_update() const { return settings_.has_update() || !exposures_us_.empty(); }
  /// The newest light.
  [[nodiscard]] CameraLight receive();

 private:
  LiveSettings<LightSettings> settings_;
  BoundedQueue<double> exposures_us_{1, Overflow::kDropOldest};
  LightSettings newest_;
  std::optional<double> automatic_us_;
};

/// Pushes the camera's frames to `frames`, and returns the frames in `recycled` to the camera. A
/// light that the camera refuses is its diagnosis; frames go on arriving. All references must
/// outlive the sensor.
[[nodiscard]] Sensor camera_sensor(const std::string& name, const OpenCamera& open,
                                   LiveLight& light, const Clock& clock, FrameQueue& frames,
                                   FrameQueue& recycled);

}  // namespace crepes
