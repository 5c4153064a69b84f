/// USB3 Vision and GigE Vision cameras, through the library Aravis.
#pragma once

#include <memory>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/config.hpp"

namespace crepes {

/// Opens the camera that `config.device` names, sets it up and lets it run. May take some seconds,
/// as may closing it when it is gone. Its frames lie where the driver received them. `clock` must
/// outlive it.
[[nodiscard]] Result<std::unique_ptr<Camera>> open_aravis_camera(const CameraConfig& config,
                                                                 std::uint8_t index,
                                                                 const Clock& clock);

/// Asks USB and network; takes a second.
[[nodiscard]] std::vector<FoundCamera> find_aravis_cameras();

}  // namespace crepes
