#include <gtest/gtest.h>

#include "estimator/swarm/team_intake.hpp"

namespace crepes::team_intake_bounds_test {
namespace {

using namespace std::chrono_literals;

SwarmConfig swarm_of(const std::vector<RobotId>& ids) {
  SwarmConfig swarm;
  for (const RobotId id : ids) swarm.members.emplace_back().id = id;
  return swarm;
}

FilterSettings of_ranges_up_to(double max_range_m) {
  FilterSettings settings;
  settings.max_range_m = max_range_m;
  return settings;
}

/// What robot 2 reports of each of these at 1 s.
Report report_about(const std::vector<RobotId>& neighbors) {
  Report report;
  report.sender = RobotId{2};
  report.stamp = Timestamp{1s};
  for (const RobotId neighbor : neighbors) {
    report.bearings.push_back(
        {report.stamp, neighbor, Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero(), 0.001});
    report.ranges.push_back({report.stamp, neighbor, 4.0, -80.0, -80.0});
  }
  return report;
}

ImuHistory resting() {
  ImuHistory imu;
  for (Timestamp t{}; t <= Timestamp{2s}; t += 10ms)
    imu.push({t, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
  return imu;
}

TEST(TeamIntakeBounds, HasNothingOfRobotsThatAreNoMembers) {
  const SwarmConfig swarm = swarm_of({RobotId{1}, RobotId{2}, RobotId{3}});
  const FilterSettings settings = of_ranges_up_to(100.0);
  const ImuHistory imu = resting();
  std::vector<RobotId> asked;
  const auto imu_of = [&](RobotId robot) {
    asked.push_back(robot);
    return &imu;
  };
  std::vector<RobotId> anybody{RobotId{2}, RobotId{3}};  // itself, a member, and strangers
  for (std::uint16_t id = 4; id < 500; ++id) anybody.push_back(RobotId{id});
  TeamIntake intake;
  (void)intake.drain(RobotId{1}, Timestamp{900ms}, swarm, settings, imu_of);

  intake.add_report(report_about(anybody), 0.0, swarm, settings);
  asked.clear();
  const auto interval = intake.drain(RobotId{1}, Timestamp{1300ms}, swarm, settings, imu_of);

  ASSERT_TRUE(interval);
  ASSERT_EQ(interval->bearings.size(), 1U);
  EXPECT_EQ(interval->bearings[0].bearing.neighbor, RobotId{3});
  ASSERT_EQ(interval->ranges.size(), 1U);
  EXPECT_EQ(interval->ranges[0].neighbor, RobotId{3});
  EXPECT_EQ(interval->members.size(), 3U);
  EXPECT_EQ(asked, (std::vector{RobotId{1}, RobotId{2}, RobotId{3}}));
}

TEST(TeamIntakeBounds, KeepsABoundedNumberWhileNothingIsDrained) {
  const SwarmConfig swarm = swarm_of({RobotId{1}, RobotId{2}, RobotId{3}});
  const FilterSettings settings = of_ranges_up_to(100.0);
  const ImuHistory imu = resting();
  const auto imu_of = [&](RobotId) { return &imu; };
  TeamIntake intake;
  (void)intake.drain(RobotId{1}, Timestamp{900ms}, swarm, settings, imu_of);

  for (int i = 0; i < 30'000; ++i)
    intake.add_report(report_about({RobotId{3}}), 0.0, swarm, settings);
  const auto interval = intake.drain(RobotId{1}, Timestamp{1300ms}, swarm, settings, imu_of);

  ASSERT_TRUE(interval);
  EXPECT_EQ(interval->bearings.size(), 20'000U);
  EXPECT_LE(interval->ranges.size(), 20'000U);
}

}  // namespace
}  // namespace crepes::team_intake_bounds_test
