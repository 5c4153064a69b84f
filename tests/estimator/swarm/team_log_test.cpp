#include "estimator/swarm/team_log.hpp"

#include <gtest/gtest.h>

namespace crepes::team_log_test {
namespace {

using namespace std::chrono_literals;
using Kind = TeamResidual::Kind;

constexpr RobotId kRobot{3};

/// A tenth of a second after the last one.
class Log : public testing::Test {
 protected:
  void add(std::vector<TeamResidual> residuals, std::vector<TeamFault> faults = {}) {
    now_ += 100ms;
    RobotCalibration calibration;
    calibration.robot = kRobot;
    log_.add({.stamp = now_,
              .poses = {},
              .calibrations = {calibration},
              .residuals = std::move(residuals),
              .faults = std::move(faults)});
  }
  [[nodiscard]] ResidualStatus residual(Kind kind) const {
    return log_.status()->robots.at(0).residuals.at(static_cast<std::size_t>(kind));
  }

  Timestamp now_{10s};
  TeamLog log_;
};

TeamResidual bearings(double nis, int fused, int refused = 0) {
  return {.observer = kRobot,
          .neighbor = RobotId{1},
          .kind = Kind::kBearing,
          .fused = fused,
          .refused = refused,
          .nis = nis,
          .dimension = 2};
}

TEST_F(Log, HasNoStatusBeforeTheFirstSolution) { EXPECT_FALSE(log_.status()); }

TEST_F(Log, MeansTheNisOfWhatWasFusedAndCountsAll) {
  add({bearings(2.0, 4), bearings(6.0, 3, 1)});
  EXPECT_NEAR(residual(Kind::kBearing).nis.value(), 2.0, 1e-12);
  add({bearings(1000.0, 0, 5)});  // of readings that were refused
  EXPECT_NEAR(residual(Kind::kBearing).nis.value(), 2.0, 1e-12);
  EXPECT_EQ(residual(Kind::kBearing).fused, 7U);
  EXPECT_EQ(residual(Kind::kBearing).refused, 6U);
  EXPECT_FALSE(residual(Kind::kRange).nis);
  EXPECT_EQ(log_.status()->stamp, now_);
}

TEST_F(Log, ForgetsOldResidualsButNotTheirCounts) {
  for (int i = 0; i < 100; ++i) add({bearings(20.0, 4)});
  for (int i = 0; i < 300; ++i) add({bearings(2.0, 4)});
  EXPECT_NEAR(residual(Kind::kBearing).nis.value(), 1.0, 0.1);
  EXPECT_EQ(residual(Kind::kBearing).fused, 1600U);
  for (int i = 0; i < 600; ++i) add({});
  EXPECT_FALSE(residual(Kind::kBearing).nis);
  EXPECT_EQ(residual(Kind::kBearing).fused, 1600U);
}

TEST_F(Log, KnowsTheFaultsOfEachRobot) {
  add({}, {{kRobot, TeamFault::Kind::kClock, 0.02}, {RobotId{1}, TeamFault::Kind::kRanges, 1.0}});
  ASSERT_EQ(log_.faults_of(kRobot).size(), 1U);
  EXPECT_EQ(log_.faults_of(kRobot).front().kind, TeamFault::Kind::kClock);
  EXPECT_EQ(log_.status()->robots.at(0).faults.size(), 1U);
  log_.clear();
  EXPECT_TRUE(log_.faults_of(kRobot).empty());
  EXPECT_FALSE(log_.status());
}

}  // namespace
}  // namespace crepes::team_log_test
