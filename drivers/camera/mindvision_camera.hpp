/// MindVision cameras, through the vendor's library, which is looked for at run time.
#pragma once

#include <memory>

#include "drivers/camera/camera.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/config.hpp"

namespace crepes {

/// Loads `config.library` and opens the camera with serial number `config.device`, or the only one.
/// Its frames lie where the library received them. `clock` must outlive it.
[[nodiscard]] Result<std::unique_ptr<Camera>> open_mindvision_camera(const CameraConfig& config,
                                                                     std::uint8_t index,
                                                                     const Clock& clock);

}  // namespace crepes
