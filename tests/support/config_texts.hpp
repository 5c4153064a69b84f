/// A small configuration file, for tests that break one thing in it.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "config/reading/config_file.hpp"

namespace crepes::test {

/// A good one.
inline constexpr const char* kGood = R"(robot: {id: 1}
swarm:
  members:
    - {id: 1, name: r1, pattern: "011111111111111111"}
    - {id: 2, name: r2, duty: 0.3}
cameras:
  - name: cam0
    intrinsics: [-0.17, 0.59, 316.7, 316.6, 637.6, 512.6]
    resolution: [1280, 1024]
    T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0.01], [1, 0, 0, -0.06], [0, 0, 0, 1]]
uwb: {noise_m: 0.05}
)";

/// It, with `to` instead of `from`.
inline std::string replaced(const std::string& from, const std::string& to) {
  std::string text = kGood;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// All faults of a text, one a line, as the daemon prints them.
inline std::string faults_of(const std::string& text) {
  std::string lines;
  for (const ConfigFault& fault : check_config_text(text, "f").faults)
    lines += (lines.empty() ? "" : "\n") + to_string(fault);
  return lines;
}

}  // namespace crepes::test
