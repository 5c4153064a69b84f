/// What a camera has counted under some name.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "drivers/camera/camera.hpp"

namespace crepes {

inline std::uint64_t total_of(const Totals& totals, const std::string& name) {
  for (const auto& [reason, total] : totals)
    if (reason == name) return total;
  ADD_FAILURE() << "nobody counts " << name;
  return 0;
}
inline std::uint64_t faults_of(const Camera& camera, const std::string& name) {
  return total_of(camera.counters().faults, name);
}
inline std::uint64_t counts_of(const Camera& camera, const std::string& name) {
  return total_of(camera.counters().counts, name);
}

}  // namespace crepes
