#include "estimator/swarm/settings_change.hpp"

#include <gtest/gtest.h>

namespace crepes::settings_change_test {
namespace {

EstimatorSettings three_robots() {
  EstimatorSettings settings;
  settings.self = RobotId{1};
  for (const std::uint16_t id : {1, 2, 3}) {
    MemberConfig member;
    member.id = RobotId{id};
    member.name = "r" + std::to_string(id);
    settings.swarm.members.push_back(member);
  }
  return settings;
}

TEST(SettingsChange, NamesRatesAndNoiseRestartNothing) {
  EstimatorSettings now = three_robots();
  now.swarm.members[1].name = "other";
  now.report_rate_hz = 10.0;
  now.imu.accelerometer_noise_density *= 2.0;

  const SettingsChange change = change_between(three_robots(), now);

  EXPECT_FALSE(change.restarts_tracks);
  EXPECT_FALSE(change.restarts_team);
  EXPECT_TRUE(change.restarts_neighbors.empty());
}

TEST(SettingsChange, AnotherMountingRestartsThatNeighborAndTheTeam) {
  EstimatorSettings now = three_robots();
  now.swarm.members[1].p_body_uwb.x() = 0.1;

  const SettingsChange change = change_between(three_robots(), now);

  EXPECT_FALSE(change.restarts_tracks);
  EXPECT_TRUE(change.restarts_team);
  EXPECT_EQ(change.restarts_neighbors, std::set{RobotId{2}});
}

TEST(SettingsChange, AnotherCodeRestartsTheTracksAndThatNeighbor) {
  EstimatorSettings now = three_robots();
  now.swarm.members[2].duty = 0.5;

  const SettingsChange change = change_between(three_robots(), now);

  EXPECT_TRUE(change.restarts_tracks);
  EXPECT_FALSE(change.restarts_team);
  EXPECT_EQ(change.restarts_neighbors, std::set{RobotId{3}});
}

TEST(SettingsChange, WhatChangesOfThisRobotRestartsAllNeighbors) {
  EstimatorSettings now = three_robots();
  now.swarm.members[0].range_delay_m = 0.2;

  EXPECT_EQ(change_between(three_robots(), now).restarts_neighbors,
            (std::set{RobotId{2}, RobotId{3}}));
}

TEST(SettingsChange, AMemberThatLeavesIsForgotten) {
  EstimatorSettings now = three_robots();
  now.swarm.members.pop_back();

  const SettingsChange change = change_between(three_robots(), now);

  EXPECT_FALSE(change.restarts_team);
  EXPECT_EQ(change.restarts_neighbors, std::set{RobotId{3}});
}

TEST(SettingsChange, OtherPriorsRestartTheTeamOnly) {
  EstimatorSettings now = three_robots();
  now.imu.gyroscope_bias_sigma *= 2.0;

  const SettingsChange change = change_between(three_robots(), now);

  EXPECT_TRUE(change.restarts_team);
  EXPECT_TRUE(change.restarts_neighbors.empty());
}

}  // namespace
}  // namespace crepes::settings_change_test
