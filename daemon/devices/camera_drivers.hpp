/// Selects the driver of a configured camera.
#pragma once

#include <cstddef>

#include "config/schema/config.hpp"
#include "daemon/devices/camera_sensor.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Opens `config.cameras[index]`. `clock` must outlive the camera.
[[nodiscard]] OpenCamera real_camera(const Config& config, std::size_t index, const Clock& clock);

}  // namespace crepes
