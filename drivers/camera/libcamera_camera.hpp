/// Cameras on the CSI ports of single-board computers, through libcamera.
#pragma once

#include <cstdint>
#include <memory>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/camera_config.hpp"
#include "drivers/camera/libcamera_device.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Opens and starts the camera. Frames of 8 bits stay in the device's buffers, deeper ones are
/// narrowed. `clock` must outlive the camera.
[[nodiscard]] Result<std::unique_ptr<Camera>> open_libcamera_camera(const CameraConfig& config,
                                                                    std::uint8_t index,
                                                                    const Clock& clock);

/// The same with a device that runs.
[[nodiscard]] std::unique_ptr<Camera> make_libcamera_camera(std::unique_ptr<LibcameraDevice> device,
                                                            const CameraConfig& config,
                                                            std::uint8_t index, const Clock& clock);

}  // namespace crepes
