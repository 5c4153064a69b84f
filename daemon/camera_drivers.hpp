/// Which driver a configured camera is opened with.
#pragma once

#include <cstddef>

#include "daemon/sensor_stages.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/config.hpp"

namespace crepes {

/// Opens `config.cameras[index]`; `clock` must outlive what it opens.
[[nodiscard]] OpenCamera real_camera(const Config& config, std::size_t index, const Clock& clock);

}  // namespace crepes
