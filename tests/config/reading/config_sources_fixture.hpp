/// What the tests of a configuration out of several files begin with: a folder to write them to.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

#include "config/reading/config_file.hpp"
#include "drivers/base/scratch_directory.hpp"

namespace crepes::test {

inline constexpr const char* kBase = R"(robot: {id: 1}
swarm:
  members:
    - {id: 1, name: r1, duty: 0.3}
    - {id: 2, name: r2, duty: 0.6}
cameras:
  - name: cam0
    intrinsics: [-0.17, 0.59, 316.7, 316.6, 637.6, 512.6]
    resolution: [1280, 1024]
    T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0.01], [1, 0, 0, -0.06], [0, 0, 0, 1]]
uwb: {noise_m: 0.05, port: /dev/uwb}
subscription: {listen: ["127.0.0.1", "::1"]}
)";

/// Of a file that all robots share.
inline constexpr const char* kMembers = R"(swarm:
  slot_ms: 12.5
  members:
    - {id: 1, name: r1, duty: 0.3}
    - {id: 2, name: r2, duty: 0.6}
)";

/// `text` with the lines from the one that begins with `from` up to the one that begins with `to`
/// replaced.
inline std::string replaced(std::string text, const std::string& from, const std::string& to,
                            const std::string& by) {
  const std::size_t begin = text.find(from);
  const std::size_t end = text.find(to);
  EXPECT_TRUE(begin < end && end != std::string::npos) << from;
  return text.replace(begin, end - begin, by);
}

class ConfigSources : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = path(name);
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  [[nodiscard]] std::filesystem::path path(const std::string& name) const {
    return folder_.path() / name;
  }

  [[nodiscard]] CheckedConfig check() const { return check_config(path("crepesd.yaml")); }
  [[nodiscard]] Config load() const {
    const CheckedConfig checked = check();
    EXPECT_EQ(text_of(checked), "");
    return checked.config;
  }
  /// All faults, one a line, files named from the folder.
  [[nodiscard]] std::string faults() const { return text_of(check()); }

 private:
  [[nodiscard]] std::string text_of(const CheckedConfig& checked) const {
    std::string lines;
    const std::string folder = folder_.path().string() + "/";
    for (const ConfigFault& fault : checked.faults) {
      std::string line = to_string(fault);
      for (std::size_t at = line.find(folder); at != std::string::npos; at = line.find(folder))
        line.erase(at, folder.size());
      lines += (lines.empty() ? "" : "\n") + line;
    }
    return lines;
  }

  ScratchDirectory folder_ = ScratchDirectory::create({}).value();
};

}  // namespace crepes::test
