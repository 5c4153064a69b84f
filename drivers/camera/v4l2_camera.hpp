/// Cameras of the Linux kernel (Video4Linux 2).
#pragma once

#include <memory>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/camera_config.hpp"
#include "drivers/camera/v4l2_device.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Opens the device at `config.device.id`, configures it and starts the stream: GREY, whose frames
/// stay in the kernel's buffers, or Y16, Y12, Y10, narrowed to 8 bits. `clock` must be the
/// machine's monotonic clock, which the kernel stamps frames with, and must outlive the camera.
[[nodiscard]] Result<std::unique_ptr<Camera>> open_v4l2_camera(const CameraConfig& config,
                                                               std::uint8_t index,
                                                               const Clock& clock);

/// The same with a device that is open.
[[nodiscard]] Result<std::unique_ptr<Camera>> start_v4l2_camera(std::unique_ptr<V4l2Device> device,
                                                                const CameraConfig& config,
                                                                std::uint8_t index,
                                                                const Clock& clock);

}  // namespace crepes
