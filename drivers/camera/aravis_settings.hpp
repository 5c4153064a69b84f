/// Configures an Aravis camera before its stream starts.
#pragma once

#include <arv.h>

#include "drivers/camera/camera_config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Stops the stream and sets pixel format, region, trigger, rate, exposure, gain and packet size
/// from `config`. The error names the setting, and what the camera offers instead if that is known.
[[nodiscard]] Result<void> configure_aravis(ArvCamera* camera, const CameraConfig& config);

/// Exposure and gain, at any time.
[[nodiscard]] Result<void> set_aravis_light(ArvCamera* camera, const CameraLight& light);

}  // namespace crepes
