#include "estimator/team/trust/gyro_check.hpp"

#include <gtest/gtest.h>

#include "tests/support/simulated_belief.hpp"

namespace crepes::gyro_check_test {
namespace {

using test::SimulatedTeam;

constexpr RobotId kOther{4};

struct Scene {
  TeamInterval interval;
  TeamBelief belief;

  explicit Scene(SimulatedTeam& team)
      : Scene{test::motions_of(team), team.next()} {}  // in this order
  Scene(const test::TrueMotions& before, TeamInterval next)
      : interval(std::move(next)), belief(test::true_belief(before, interval)) {}

  [[nodiscard]] std::map<RobotId, GyroCheck> checks() const {
    return gyro_checks(interval, belief.trajectories(interval), belief);
  }
};

// The chi-square of what honest gyroscopes read, for each dimension. The errors of bearings last
// longer than the interval, so that their change is known better than is allowed for.
TEST(GyroCheck, HonestGyroscopesAgreeWithWhatTheirCamerasSee) {
  double chi2 = 0.0;
  int dimension = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SimulatedTeam team(seed);
    const auto checks = Scene(team).checks();
    ASSERT_EQ(checks.size(), 4U);
    for (const auto& [robot, check] : checks) {
      EXPECT_FALSE(check.contradiction) << seed << ", robot " << robot.value;
      chi2 += check.chi2;
      dimension += check.dimension;
    }
  }
  EXPECT_LT(chi2 / dimension, 1.2);
  EXPECT_GT(chi2 / dimension, 0.0);
}

// Of a robot that has just been placed, anything is likely.
TEST(GyroCheck, OnlyTrustedRobotsThatSeeTrustedOnesConfirmAGyroscope) {
  SimulatedTeam team(1);
  Scene scene(team);
  for (const auto& [robot, check] : scene.checks()) EXPECT_TRUE(check.is_confirmed) << robot.value;
  scene.belief.robots.at(kOther).is_trusted = false;
  for (const auto& [robot, check] : scene.checks())
    EXPECT_EQ(check.is_confirmed, robot != kOther) << robot.value;
  for (auto& [id, robot] : scene.belief.robots) robot.is_trusted = id == test::kSelf;
  for (const auto& [robot, check] : scene.checks()) EXPECT_FALSE(check.is_confirmed) << robot.value;
}

TEST(GyroCheck, MeasuresByHowMuchAGyroscopeIsOff) {
  const Eigen::Vector3d error(0.0, 0.4, -0.3);  // rad/s
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    team.damage = [&](TeamInterval& interval) {
      for (TeamMember& member : interval.members)
        if (member.robot == kOther)
          for (ImuMean& mean : member.imu) mean.gyro_radps += error;
    };
    const auto checks = Scene(team).checks();
    const auto& of_liar = checks.at(kOther).contradiction;
    ASSERT_TRUE(of_liar) << seed;
    EXPECT_NEAR(of_liar->rate_radps, error.norm(), 0.15) << seed;
    EXPECT_FALSE(of_liar->may_be_leap) << seed;
    for (const auto& [robot, check] : checks)
      EXPECT_EQ(check.contradiction.has_value(), robot == kOther) << seed;
  }
}

// A turned camera sees the same changes from elsewhere.
TEST(GyroCheck, ATurnedCameraIsNoContradiction) {
  const Eigen::Quaterniond turn = so3_exp(radians(20.0) * Eigen::Vector3d(0.6, 0.0, 0.8));
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    team.damage = [&](TeamInterval& interval) {
      for (TeamBearing& b : interval.bearings)
        if (b.observer == kOther) b.bearing.u_B = turn * b.bearing.u_B;
    };
    for (const auto& [robot, check] : Scene(team).checks())
      EXPECT_FALSE(check.contradiction) << seed << ", robot " << robot.value;
  }
}

// Something hits it within the interval. A rate goes on, in the next one.
TEST(GyroCheck, ACameraThatIsKnockedLeaps) {
  const Eigen::Quaterniond turn = so3_exp(radians(2.0) * Eigen::Vector3d(0.6, 0.0, 0.8));
  for (const double knocked_s : {0.03, 0.06}) {
    SimulatedTeam team(1);
    team.damage = [&](TeamInterval& interval) {
      for (TeamBearing& b : interval.bearings)
        if (b.observer == kOther && to_seconds(b.bearing.stamp - interval.from) > knocked_s)
          b.bearing.u_B = turn * b.bearing.u_B;
    };
    Scene scene(team);
    const auto checks = scene.checks();
    const auto& contradiction = checks.at(kOther).contradiction;
    ASSERT_TRUE(contradiction) << knocked_s;
    EXPECT_TRUE(contradiction->may_be_leap) << knocked_s;
  }
}

// They start with wrong velocities here. If they were trusted, two of the three robots that another
// one sees would contradict its gyroscope.
TEST(GyroCheck, RobotsThatHaveJustBeenPlacedSayNothingBesideTrustedOnes) {
  constexpr RobotId kObserver{2};
  SimulatedTeam team(1);
  Scene scene(team);
  for (const RobotId wrong : {RobotId{3}, RobotId{4}})
    scene.belief.robots.at(wrong).motion.v_F += Eigen::Vector3d(2.0, 0.0, 3.0);
  EXPECT_EQ(scene.checks().at(kObserver).dimension, 6);
  for (const RobotId wrong : {RobotId{3}, RobotId{4}})
    scene.belief.robots.at(wrong).is_trusted = false;
  const auto checks = scene.checks();
  EXPECT_EQ(checks.at(kObserver).dimension, 2);
  EXPECT_LT(checks.at(kObserver).chi2, 6.0);
  EXPECT_FALSE(checks.at(kObserver).contradiction);
  // Where it sees no other ones, they count.
  for (auto& [id, robot] : scene.belief.robots) robot.is_trusted = id == kObserver;
  EXPECT_EQ(scene.checks().at(kObserver).dimension, 6);
  EXPECT_GT(scene.checks().at(kObserver).chi2, 30.0);
}

// The robot sees the images of all others in the floor, and loses sight of the robots themselves.
TEST(GyroCheck, MirrorImagesThatRemainAloneAreNoContradiction) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedTeam team(seed);
    team.damage = [&](TeamInterval& interval) {
      const Timestamp middle = interval.from + (interval.to - interval.from) / 2;
      std::vector<TeamBearing> images;
      for (TeamBearing& b : interval.bearings) {
        if (b.observer != kOther) continue;
        TeamBearing image = b;
        image.bearing.u_B = (b.bearing.u_B - 0.5 * Eigen::Vector3d::UnitZ()).normalized();
        if (b.bearing.stamp < middle)
          images.push_back(image);
        else
          b = image;
      }
      interval.bearings.insert(interval.bearings.end(), images.begin(), images.end());
    };
    for (const auto& [robot, check] : Scene(team).checks())
      EXPECT_FALSE(check.contradiction) << seed << ", robot " << robot.value;
  }
}

/// A robot that sees only one other.
class OneSight : public testing::Test {
 protected:
  static constexpr RobotId kOnly{2};

  explicit OneSight() {
    team_.sees = [](RobotId i, RobotId j) { return i != kOther || j == kOnly; };
  }
  void make_gyro_false() {
    team_.damage = [](TeamInterval& interval) {
      for (TeamMember& member : interval.members)
        if (member.robot == kOther)
          for (ImuMean& mean : member.imu) mean.gyro_radps.z() += 1.0;
    };
  }
  /// Bearings that were used and refused before.
  static void set_agreement(Scene& scene, double fused, double gated) {
    scene.belief.robots.at(kOther).cameras.front().agreement[kOnly] = {fused, gated};
  }

  SimulatedTeam team_{1};
};

TEST_F(OneSight, ProvesAFalseGyroscopeIfTheOtherRobotSeesNothingUnusual) {
  make_gyro_false();
  Scene scene(team_);
  set_agreement(scene, 30.0, 4.0);
  const auto checks = scene.checks();
  ASSERT_TRUE(checks.at(kOther).contradiction);
  EXPECT_TRUE(checks.at(kOther).contradiction->may_be_leap);
  EXPECT_GT(checks.at(kOther).contradiction->chi2, 10.0);
}

TEST_F(OneSight, ThatDisagreedBeforeMayBeAMirrorImage) {
  make_gyro_false();
  Scene scene(team_);
  EXPECT_FALSE(scene.checks().at(kOther).contradiction) << "it was never seen before";
  set_agreement(scene, 10.0, 10.0);
  EXPECT_FALSE(scene.checks().at(kOther).contradiction);
  EXPECT_GT(scene.checks().at(kOther).chi2, 10.0);
}

TEST_F(OneSight, OfARobotThatDoesNotSeeUsProvesNothing) {
  make_gyro_false();
  team_.sees = [](RobotId i, RobotId j) {
    return (i != kOther || j == kOnly) && (i != kOnly || j != kOther);
  };
  Scene scene(team_);
  set_agreement(scene, 30.0, 4.0);
  EXPECT_FALSE(scene.checks().at(kOther).contradiction);
}

// Then it sees us otherwise than expected, too.
TEST_F(OneSight, OfARobotThatMovesOtherwiseThanBelievedProvesNothing) {
  Scene scene(team_);
  set_agreement(scene, 30.0, 4.0);
  scene.belief.robots.at(kOnly).motion.v_F += Eigen::Vector3d(0.0, 3.0, 3.0);
  const auto checks = scene.checks();
  EXPECT_FALSE(checks.at(kOther).contradiction);
  EXPECT_GT(checks.at(kOther).chi2, 10.0);
}

TEST(GyroCheck, SaysNothingAboutARobotThatSeesNobody) {
  SimulatedTeam team(1);
  team.sees = [](RobotId i, RobotId) { return i != kOther; };
  const auto checks = Scene(team).checks();
  EXPECT_FALSE(checks.contains(kOther));
  EXPECT_EQ(checks.size(), 3U);
}

}  // namespace
}  // namespace crepes::gyro_check_test
