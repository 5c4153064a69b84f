/// The part of a configuration that the estimator receives.
#pragma once

#include "config/schema/config.hpp"
#include "estimator/swarm/estimator_settings.hpp"

namespace crepes {

[[nodiscard]] EstimatorSettings estimator_settings(const Config& config);

}  // namespace crepes
