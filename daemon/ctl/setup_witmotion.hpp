/// crepesctl setup-witmotion: an inertial sensor set to what the daemon wants of it.
#pragma once

#include <chrono>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

struct WitMotionSetup {
  std::string port;
  int baud = 115200;
  int rate_hz = 100;
  std::chrono::milliseconds pause{200};    ///< after each command
  std::chrono::milliseconds listen{2000};  ///< to the samples that must come then
};

/// Sets outputs and rate, saves both in the sensor, and listens whether it obeys: the samples a
/// second that come. Another rate than was asked for is an error.
[[nodiscard]] Result<double> set_up_witmotion(const WitMotionSetup& setup);

}  // namespace crepes
