#include "daemon/service/systemd_status.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace crepes::systemd_status_test {
namespace {

NeighborStatus located(std::uint16_t id) {
  NeighborStatus neighbor;
  neighbor.neighbor = RobotId{id};
  neighbor.name = "r" + std::to_string(id);
  neighbor.pose.emplace();
  return neighbor;
}

NeighborStatus unknown(std::uint16_t id, NoPoseReason reason) {
  NeighborStatus neighbor = located(id);
  neighbor.pose.reset();
  neighbor.reason = reason;
  return neighbor;
}

TEST(SystemdStatus, SaysWhichNeighborsAreNotLocatedAndWhy) {
  SystemStatus status;
  status.estimator.neighbors = {located(2), unknown(3, NoPoseReason::kNotSeen),
                                unknown(4, NoPoseReason::kNeverHeard)};

  EXPECT_EQ(systemd_status(status), "1 of 3 neighbors located (r3: not seen, r4: never heard)");
}

TEST(SystemdStatus, NamesSensorsWithFaultsOnly) {
  SystemStatus status;
  status.estimator.neighbors = {located(2)};
  status.sensors = {{"cam0", 200.0, true, "", {}}, {"imu", 0.0, false, "no such file", {}}};

  EXPECT_EQ(systemd_status(status), "1 of 1 neighbor located; imu: no such file");
}

TEST(SystemdStatus, StaysOneShortLineWhateverThereIsToSay) {
  SystemStatus status;
  for (std::uint16_t id = 2; id < 200; ++id)
    status.estimator.neighbors.push_back(unknown(id, NoPoseReason::kSilent));
  status.sensors = {{"imu", 0.0, false, std::string(1000, 'x').append("\nmore"), {}}};
  status.config.fault = "crepesd.yaml:3: uwb.noise_m: outside\ncrepesd.yaml:4: another";

  const std::string line = systemd_status(status);

  EXPECT_LT(line.size(), 800);
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST(SystemdStatus, StaysShortWhateverTheTeamFindsWrong) {
  SystemStatus status;
  for (std::uint16_t id = 2; id < 50; ++id) {
    status.estimator.neighbors.push_back(located(id));
    status.estimator.neighbors.back().faults = {{.robot = RobotId{id}}};
  }

  EXPECT_LT(systemd_status(status).size(), 800);
}

// systemd refuses a status that is not UTF-8.
TEST(SystemdStatus, CutsNoCharacter) {
  SystemStatus status;
  for (const std::string start : {"", "x"}) {
    std::string message = start;
    for (int i = 0; i < 200; ++i) message += "\u00e9";
    status.sensors = {{"imu", 0.0, false, message, {}}};

    const std::string line = systemd_status(status);

    EXPECT_TRUE(line.ends_with("\u00e9")) << line;
  }
}

TEST(SystemdStatus, SaysWhatWaitsForARestartAndWhyAReloadWasRefused) {
  SystemStatus status;
  status.config.restart = {"cameras", "sim"};
  status.config.fault = "crepesd.yaml:3: uwb.noise_m: outside [0.001, 2]";

  const std::string line = systemd_status(status);

  EXPECT_NE(line.find("restart to apply: cameras, sim"), std::string::npos) << line;
  EXPECT_NE(line.find("reload refused: crepesd.yaml:3: uwb.noise_m"), std::string::npos) << line;
}

}  // namespace
}  // namespace crepes::systemd_status_test
