/// MindVision cameras, through the vendor's library, which is loaded at run time.
#pragma once

#include <memory>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/camera_config.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Loads `config.device.library` and opens the camera with serial number `config.device.id`, or the
/// only camera. Frames remain in the buffers of the library. `clock` must outlive the camera.
[[nodiscard]] Result<std::unique_ptr<Camera>> open_mindvision_camera(const CameraConfig& config,
                                                                     std::uint8_t index,
                                                                     const Clock& clock);

}  // namespace crepes
