/// USB3 Vision and GigE Vision cameras, through the library Aravis.
#pragma once

#include <memory>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/camera_config.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Opens the camera `config.device.id`, configures it and starts the stream. This may need several
/// seconds, as may closing a camera that is gone. Frames remain in the driver's buffers. `clock`
/// must outlive the camera.
[[nodiscard]] Result<std::unique_ptr<Camera>> open_aravis_camera(const CameraConfig& config,
                                                                 std::uint8_t index,
                                                                 const Clock& clock);

/// Queries USB and network; needs a second.
[[nodiscard]] std::vector<FoundCamera> find_aravis_cameras();

}  // namespace crepes
