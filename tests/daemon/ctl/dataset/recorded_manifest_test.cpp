#include "daemon/ctl/dataset/recorded_manifest.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace crepes::recorded_manifest_test {
namespace {

TEST(RecordedManifest, ListsNoClockWhoseRateIsNotKnown) {
  Config config;
  config.robot.id = RobotId{1};
  for (std::uint16_t id = 1; id <= 3; ++id) {
    MemberConfig& member = config.swarm.members.emplace_back();
    member.id = RobotId{id};
    member.name = "r" + std::to_string(id);
  }
  const Timestamp first{std::chrono::seconds{100}};

  const std::string text =
      recorded_manifest(config, "r1", first, first + std::chrono::seconds{10},
                        {{.peer = 2, .offset_s = 4.5, .skew_ppm = {}, .sigma_s = {}},
                         {.peer = 3, .offset_s = -2.0, .skew_ppm = 10.0, .sigma_s = 1e-5}});

  EXPECT_EQ(text.find("# - {id: 2"), std::string::npos) << text;
  EXPECT_NE(text.find("# - {id: 3, name: r3, dir: r3"), std::string::npos) << text;
}

}  // namespace
}  // namespace crepes::recorded_manifest_test
