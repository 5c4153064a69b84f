/// A camera as a sensor.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "daemon/devices/sensor.hpp"
#include "daemon/stages/bounded_queue.hpp"
#include "drivers/camera/camera.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

using FrameQueue = BoundedQueue<Frame>;
using OpenCamera = std::function<Result<std::unique_ptr<Camera>>()>;

/// Pushes the camera's frames to `frames`, and returns the frames in `recycled` to the camera. All
/// references must outlive the sensor.
[[nodiscard]] Sensor camera_sensor(const std::string& name, const OpenCamera& open,
                                   const Clock& clock, FrameQueue& frames, FrameQueue& recycled);

}  // namespace crepes
