/// What an Aravis camera is told before it runs.
#pragma once

#include <arv.h>

#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Stops it, and sets pixel format, region, trigger, rate, exposure, gain and packets as `config`
/// says. The error names the setting, and what the camera offers instead where it can tell.
[[nodiscard]] Result<void> set_up_aravis(ArvCamera* camera, const CameraConfig& config);

}  // namespace crepes
