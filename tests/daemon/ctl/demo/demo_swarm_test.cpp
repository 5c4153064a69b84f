#include "daemon/ctl/demo/demo_swarm.hpp"

#include <gtest/gtest.h>

#include "config/reading/config_file.hpp"

namespace crepes::demo_swarm_test {
namespace {

TEST(DemoSwarm, GivesEveryRobotAValidConfiguration) {
  const std::vector<RobotId> ids{RobotId{1}, RobotId{2}, RobotId{3}, RobotId{4}, RobotId{5}};

  for (const DemoRobot& robot : demo_swarm({}, ids, 12345.5, 47481, 50000)) {
    const CheckedConfig read = check_config_text(write_config(robot.config), "demo.yaml");

    EXPECT_TRUE(read.faults.empty()) << to_string(read.faults.front());
    EXPECT_EQ(read.config.sim.clock_offset_s, robot.clock.offset_s);
    EXPECT_EQ(read.config.sim.epoch_s, 12345.5);
  }
}

}  // namespace
}  // namespace crepes::demo_swarm_test
