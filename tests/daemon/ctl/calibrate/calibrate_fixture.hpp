/// What the tests of crepesctl calibrate begin with: a configuration, and recordings made with it.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/setup/init.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes::test {

/// A configuration as crepesctl init writes it, and a recording made with it.
class Calibrate : public testing::Test {
 protected:
  Calibrate() {
    InitOptions options;
    options.dir = etc();
    options.id = 1;
    options.robots = 3;
    options.p_body_led = {0.06, 0.0, 0.01};
    options.search_devices = false;
    options.interface = "lo";
    std::ostringstream nobody;
    Questions questions(nullptr, nobody);
    EXPECT_TRUE(init(options, questions));
  }

  [[nodiscard]] std::filesystem::path etc() const { return scratch_.path() / "etc"; }
  [[nodiscard]] std::filesystem::path robot_dir(int id) const {
    return scratch_.path() / ("r" + std::to_string(id));
  }
  [[nodiscard]] Config config() const { return load_config(etc() / "crepesd.yaml").value(); }

  void write_robot(int id, const std::vector<ImuSample>& imu) const {
    RobotFolder folder(robot_dir(id));
    Config own = config();
    own.robot.id = RobotId{static_cast<std::uint16_t>(id)};
    ASSERT_TRUE(folder.write_config(write_config(own)));
    std::string rows;
    for (const ImuSample& sample : imu) append_rows(rows, sample);
    ASSERT_TRUE(folder.append("imu0", rows));
  }

  /// Boards 2 and 3 blink their patterns from a phase of their own.
  [[nodiscard]] std::map<Timestamp, SpotFrame> frames_of(
      const simulated::CameraRecording& recording) const {
    constexpr double kSlot = 10e-3;
    const std::vector<MemberConfig> members = config().swarm.members;
    std::map<Timestamp, SpotFrame> frames;
    for (const BoardSighting& sighting : recording.sightings) {
      SpotFrame& frame = frames[sighting.stamp];
      frame.stamp = sighting.stamp;
      const std::string& pattern = *members.at(sighting.board + 1).pattern;
      const double t_s = to_seconds(sighting.stamp.time_since_epoch()) +
                         0.0037 * static_cast<double>(1 + sighting.board);
      const auto slot = static_cast<std::size_t>(t_s / kSlot) % pattern.size();
      if (pattern[slot] == '1')
        frame.spots.push_back({sighting.uv.x(), sighting.uv.y(), 12.0, 200.0, 1.0});
    }
    return frames;
  }
  void write_spots(const simulated::CameraRecording& recording) const {
    std::string rows;
    for (const auto& [stamp, frame] : frames_of(recording)) append_rows(rows, frame);
    RobotFolder folder(robot_dir(1));
    ASSERT_TRUE(folder.append("cam0", rows));
  }

  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
};

}  // namespace crepes::test
