/// crepesctl led: programs the board that blinks a robot's ID, and reads it back.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "estimator/core/result.hpp"
#include "firmware/protocol/led_messages.h"

namespace crepes {

/// Options of `crepesctl led`.
struct LedOptions {
  std::string port;
  int id = 0;
  std::filesystem::path library{};   ///< any file with a section swarm
  std::vector<int> brightness{100};  ///< percent: one value for all LEDs, or one for each of six
  double test_s = 5.0;
  bool json = false;
};

/// The settings for the board of swarm member `id`. Refuses times that are not multiples of a tick.
[[nodiscard]] Result<led_settings> led_settings_of(const SwarmConfig& swarm, RobotId id,
                                                   const std::vector<int>& brightness);

/// Each returns its report as text or JSON.
[[nodiscard]] Result<std::string> led_set(const LedOptions& options);
[[nodiscard]] Result<std::string> led_get(const LedOptions& options);
[[nodiscard]] Result<std::string> led_test(const LedOptions& options);

}  // namespace crepes
