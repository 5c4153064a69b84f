/// A camera as a sensor.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "daemon/devices/sensor.hpp"
#include "daemon/stages/bounded_queue.hpp"
#include "daemon/stages/live_settings.hpp"
#include "drivers/camera/camera.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

using FrameQueue = BoundedQueue<Frame>;
using OpenCamera = std::function<Result<std::unique_ptr<Camera>>(const CameraLight&)>;

/// A camera's exposure and gain: the main thread changes them, the camera's thread follows.
class LiveLight {
 public:
  explicit LiveLight(const CameraLight& initial) : settings_(initial) {}

  /// For the main thread.
  void update(const CameraLight& wanted) { settings_.update(wanted); }

  /// For the camera's thread, as is the rest.
  [[nodiscard]] bool has_update() const { return settings_.has_update(); }
  /// The newest light.
  [[nodiscard]] const CameraLight& receive() {
    if (const auto newest = settings_.receive()) light_ = *newest;
    return light_;
  }

 private:
  LiveSettings<CameraLight> settings_;
  CameraLight light_;
};

/// Pushes the camera's frames to `frames`, and returns the frames in `recycled` to the camera. A
/// light that the camera refuses is its diagnosis; frames go on arriving. All references must
/// outlive the sensor.
[[nodiscard]] Sensor camera_sensor(const std::string& name, const OpenCamera& open,
                                   LiveLight& light, const Clock& clock, FrameQueue& frames,
                                   FrameQueue& recycled);

}  // namespace crepes
