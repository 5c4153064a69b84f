/// Cameras of the Linux kernel (Video4Linux 2).
#pragma once

#include <memory>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/v4l2_device.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/config.hpp"

namespace crepes {

/// Sets the device up and lets it run: GREY, whose frames lie where the kernel put them, or Y16,
/// Y12, Y10, narrowed to 8 bits. `clock` must be the machine's monotonic one, which is what the
/// kernel stamps frames with, and outlive the camera.
[[nodiscard]] Result<std::unique_ptr<Camera>> run_v4l2_camera(std::unique_ptr<V4l2Device> device,
                                                              const CameraConfig& config,
                                                              std::uint8_t index,
                                                              const Clock& clock);

}  // namespace crepes
