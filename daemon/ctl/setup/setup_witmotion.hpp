/// crepesctl setup-witmotion: configures a WitMotion IMU for the daemon.
#pragma once

#include <chrono>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl setup-witmotion`.
struct WitMotionSetup {
  std::string port;
  int baud = 115200;
  int rate_hz = 100;
  std::chrono::milliseconds pause{200};    ///< after each command
  std::chrono::milliseconds listen{2000};  ///< time to count the samples that follow
};

/// Sets outputs and rate, saves both in the sensor, and measures the samples per second. A measured
/// rate other than the requested one is an error.
[[nodiscard]] Result<double> set_up_witmotion(const WitMotionSetup& setup);

}  // namespace crepes
