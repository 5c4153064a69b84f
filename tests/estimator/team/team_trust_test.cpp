#include "estimator/team/trust/team_trust.hpp"

#include <gtest/gtest.h>

#include "estimator/team/trust/team_faults.hpp"
#include "tests/estimator/team/trust_of_four.hpp"

namespace crepes::team_trust_test {
namespace {

using test::Ids;
using test::kAccused;
using test::kAgrees;
using test::kContradicts;
using test::kSecond;
using test::kSelf;
using test::kThird;
using namespace std::chrono_literals;

using TrustOfFour = test::TrustOfFour;

TEST_F(TrustOfFour, NobodyIsAccusedIfAllAgree) {
  EXPECT_TRUE(lost().empty());
  EXPECT_TRUE(turned().empty());
  EXPECT_FALSE(trust_.note_misleading(belief_));
  for (const RobotId robot : {kSelf, kSecond, kThird, kAccused}) {
    EXPECT_FALSE(trust_.turn_covariance(robot)) << robot.value;
    EXPECT_EQ(trust_.doubt(robot, belief_.stamp), 1.0);
  }
}

TEST_F(TrustOfFour, ARobotWhosePlaceMostCamerasContradictIsLost) {
  contradict_its_place(kAccused);
  EXPECT_EQ(lost(), Ids{kAccused});
}

TEST_F(TrustOfFour, ARobotWhosePlaceMostRangesContradictInBothDirectionsIsLostOnce) {
  range_to_all(kAccused, kContradicts, kContradicts, 0.15);
  EXPECT_EQ(lost(), Ids{kAccused});
  EXPECT_TRUE(lost().empty());
  wait(61s);
  EXPECT_EQ(lost(), Ids{kAccused});
}

TEST_F(TrustOfFour, RangesThatOnlyOneModuleMeasuresLongSayNothingOfAPlace) {
  range_to_all(kAccused, kContradicts, kAgrees, 0.15);
  EXPECT_TRUE(lost().empty());
  range_to_all(kAccused, kAgrees, kContradicts, 0.15);
  EXPECT_TRUE(lost().empty());
}

// The distance is known to 5 cm: ranges that are half a metre too long went through something.
TEST_F(TrustOfFour, RangesThatAreMuchTooLongSayNothingOfAPlace) {
  range_to_all(kAccused, kContradicts, kContradicts, 0.5);
  EXPECT_TRUE(lost().empty());
}

TEST_F(TrustOfFour, RangesToOneOtherRobotSayNothingOfAPlace) {
  range_to_all(kAccused, kContradicts, kContradicts, 0.15);
  for (const RobotId robot : {kSelf, kSecond}) range(robot, kAccused, kAgrees, kAgrees, 0.0);
  EXPECT_TRUE(lost().empty());
}

TEST_F(TrustOfFour, ARobotIsLessCertainEachTimeItIsLostAndLikeOthersLater) {
  contradict_its_place(kAccused);
  EXPECT_EQ(lost(), Ids{kAccused});
  const double once = trust_.doubt(kAccused, belief_.stamp);
  EXPECT_EQ(lost(), Ids{kAccused});
  EXPECT_GT(once, 1.0);
  EXPECT_GT(trust_.doubt(kAccused, belief_.stamp), once);
  EXPECT_EQ(trust_.doubt(kAccused, belief_.stamp + 11s), 1.0);
}

TEST_F(TrustOfFour, ACameraThatAgreesWithNobodyIsNoWitnessAndItsRobotIsLost) {
  camera_of(kAccused).agreement = {{kSecond, kContradicts}};
  camera_of(kThird).agreement = {{kSecond, kAgrees}};
  for (const RobotId other : {kSelf, kSecond}) camera_of(other).agreement.clear();
  EXPECT_EQ(lost(), Ids{kAccused});
}

TEST_F(TrustOfFour, ACameraThatAgreesWithNobodyRestartsItsRobotTwiceInTenSeconds) {
  camera_of(kAccused).agreement = {{kSecond, kContradicts}};
  for (const RobotId other : {kSelf, kSecond}) camera_of(other).agreement.clear();
  for (int restart = 1; restart <= 2; ++restart) {
    EXPECT_EQ(lost(), Ids{kAccused});
    EXPECT_EQ(trust_.doubt(kAccused, belief_.stamp), 4.0);
  }
  EXPECT_NE(lost(), Ids{kAccused});
  wait(11s);
  EXPECT_EQ(lost(), Ids{kAccused});
}

TEST_F(TrustOfFour, ACameraThatContradictsTwoIsTurnedAndItsRobotStays) {
  contradict_what_it_sees(kAccused);
  EXPECT_TRUE(lost().empty());
  EXPECT_EQ(turned(), Ids{kAccused});
}

TEST_F(TrustOfFour, ACameraIsAWitnessIfItAgreesWithSomebodyOrNobodyConfirmsWhatItSees) {
  camera_of(kAccused).agreement[kSecond] = kContradicts;
  EXPECT_TRUE(lost().empty());
  camera_of(kAccused).agreement = {{kSecond, kContradicts}};
  for (const RobotId other : {kSelf, kThird}) camera_of(other).agreement.erase(kSecond);
  EXPECT_EQ(lost(), Ids{kSecond});
}

TEST_F(TrustOfFour, ARobotThatWasAwayIsForgotten) {
  contradict_its_place(kAccused);
  EXPECT_EQ(lost(), Ids{kAccused});
  all_agree_again();
  contradict_what_it_sees(kAccused);
  EXPECT_EQ(turned(), Ids{kAccused});
  ASSERT_TRUE(trust_.turn_covariance(kAccused));

  const std::vector<TeamMember> all = interval_.members;
  std::erase_if(interval_.members, [](const TeamMember& m) { return m.robot == kAccused; });
  EXPECT_EQ(lost(), Ids{kAccused});  // it has no IMU
  interval_.members = all;

  EXPECT_FALSE(trust_.turn_covariance(kAccused));
  EXPECT_EQ(trust_.doubt(kAccused, belief_.stamp), 1.0);
}

TEST_F(TrustOfFour, ACameraThatContradictsWhatItSeesMayBeTurned) {
  contradict_what_it_sees(kAccused);
  EXPECT_EQ(turned(), Ids{kAccused});
  ASSERT_TRUE(trust_.turn_covariance(kAccused));
  EXPECT_GT(trust_.turn_covariance(kAccused)->trace(), std::pow(radians(20.0), 2));
  EXPECT_FALSE(trust_.is_refused(kAccused));
  EXPECT_FALSE(trust_.turn_covariance(kSecond));
}

TEST_F(TrustOfFour, AMisalignmentBeyondItsPriorIsATurnAboutThatAxis) {
  TeamCamera& camera = camera_of(kAccused);
  camera.misalignment = Eigen::Vector3d(0.0, 0.0, radians(3.0));
  belief_.P.block<3, 3>(camera.index, camera.index) =
      std::pow(radians(0.1), 2) * Eigen::Matrix3d::Identity();
  EXPECT_EQ(turned(), Ids{kAccused});
  const Eigen::Matrix3d turn = trust_.turn_covariance(kAccused).value();
  EXPECT_GT(turn(2, 2), 50.0 * turn(0, 0));
}

// It starts like any other robot after that, and its misalignment is tested again.
TEST_F(TrustOfFour, AVerdictOnACameraThatIsStraightExpires) {
  contradict_what_it_sees(kAccused);
  EXPECT_EQ(turned(), Ids{kAccused});
  all_agree_again();
  camera_of(kAccused).is_free = true;
  wait(19s);
  static_cast<void>(lost());
  EXPECT_TRUE(trust_.turn_covariance(kAccused));
  wait(2s);
  static_cast<void>(lost());
  EXPECT_FALSE(trust_.turn_covariance(kAccused));
  EXPECT_TRUE(turned().empty());

  TeamCamera& camera = camera_of(kAccused);
  camera.misalignment = Eigen::Vector3d(0.0, radians(3.0), 0.0);
  belief_.P.block<3, 3>(camera.index, camera.index) =
      std::pow(radians(0.1), 2) * Eigen::Matrix3d::Identity();
  EXPECT_EQ(turned(), Ids{kAccused});
  EXPECT_FALSE(trust_.is_refused(kAccused));
}

TEST_F(TrustOfFour, AVerdictLastsAsLongAsTheCameraIsTurned) {
  contradict_what_it_sees(kAccused);
  EXPECT_EQ(turned(), Ids{kAccused});
  all_agree_again();
  TeamCamera& camera = camera_of(kAccused);
  camera.is_free = true;
  camera.misalignment = Eigen::Vector3d(0.0, radians(3.0), 0.0);
  belief_.P.block<3, 3>(camera.index, camera.index) =
      std::pow(radians(0.1), 2) * Eigen::Matrix3d::Identity();
  for (int i = 0; i < 10; ++i) {
    wait(10s);
    EXPECT_TRUE(lost().empty());
    EXPECT_TRUE(turned().empty());
  }
  EXPECT_TRUE(trust_.turn_covariance(kAccused));
}

TEST_F(TrustOfFour, ACameraThatContradictsAgainMayBeAsCalibratedAgain) {
  contradict_what_it_sees(kAccused);
  EXPECT_EQ(turned(), Ids{kAccused});
  EXPECT_TRUE(trust_.turn_covariance(kAccused));
  EXPECT_EQ(turned(), Ids{kAccused});
  EXPECT_FALSE(trust_.turn_covariance(kAccused));
}

TEST_F(TrustOfFour, ACameraThatContradictsAgainAndAgainIsRefusedAndTriedAgainLater) {
  contradict_what_it_sees(kAccused);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(turned(), Ids{kAccused});
    EXPECT_FALSE(trust_.is_refused(kAccused));
  }
  EXPECT_EQ(turned(), Ids{kAccused});
  EXPECT_TRUE(trust_.is_refused(kAccused));
  all_agree_again();
  camera_of(kAccused).is_refused = true;
  wait(19s);
  EXPECT_TRUE(lost().empty());
  wait(2s);
  EXPECT_EQ(lost(), Ids{kAccused});
  EXPECT_FALSE(trust_.turn_covariance(kAccused));
}

TEST_F(TrustOfFour, WhoWasFoundTurnedBeforeAndOnceIsBelievedAgain) {
  contradict_what_it_sees(kSecond);
  EXPECT_EQ(turned(), Ids{kSecond});
  all_agree_again();
  contradict_what_it_sees(kAccused);
  EXPECT_EQ(turned(), Ids{kAccused});
  EXPECT_FALSE(trust_.turn_covariance(kSecond));
  EXPECT_TRUE(trust_.turn_covariance(kAccused));
}

TEST_F(TrustOfFour, ProbationEndsWhenMostAgreeForASecond) {
  TeamRobot& robot = belief_.robots.at(kAccused);
  robot.is_trusted = false;
  wait(900ms);
  trust_.end_probations(belief_);
  EXPECT_FALSE(robot.is_trusted);
  wait(100ms);
  contradict_its_place(kAccused);
  trust_.end_probations(belief_);
  EXPECT_FALSE(robot.is_trusted);
  all_agree_again();
  trust_.end_probations(belief_);
  EXPECT_TRUE(robot.is_trusted);
}

TEST_F(TrustOfFour, ARobotWhoseRangesContradictItsPlaceIsNotPlausible) {
  belief_.robots.at(kAccused).since = belief_.stamp;
  wait(100ms);
  ASSERT_TRUE(has_plausible_place(belief_, kAccused));

  belief_.ranges[ordered(kSecond, kAccused)].agreement[kSecond] = kContradicts;
  EXPECT_FALSE(has_plausible_place(belief_, kAccused));

  // Those of one pair may go through an obstacle.
  for (const auto& [id, robot] : belief_.robots)
    if (id != kSecond && id != kAccused)
      belief_.ranges[ordered(id, kAccused)].agreement[id] = kAgrees;
  EXPECT_TRUE(has_plausible_place(belief_, kAccused));
}

TEST_F(TrustOfFour, ARobotIsPlausibleFromItsSecondIntervalOnWhileMostOfItsBearingsAgree) {
  TeamRobot& robot = belief_.robots.at(kAccused);
  robot.since = belief_.stamp;
  EXPECT_FALSE(has_plausible_place(belief_, kAccused));
  wait(100ms);
  EXPECT_TRUE(has_plausible_place(belief_, kAccused));

  // It sees others where they are, so half of its bearings agree.
  contradict_its_place(kAccused);
  EXPECT_FALSE(has_plausible_place(belief_, kAccused));
  EXPECT_TRUE(has_plausible_place(belief_, kSecond));

  for (auto& [id, other] : belief_.robots) other.cameras[0].agreement.clear();
  EXPECT_TRUE(has_plausible_place(belief_, kAccused));  // nobody sees it
}

TEST_F(TrustOfFour, ARobotThatItsOwnRangesPlacedStaysOnProbation) {
  TeamRobot& robot = belief_.robots.at(kAccused);
  robot.is_trusted = false;
  wait(2s);
  TeamRangeBias& range = belief_.ranges.at(ordered(kSecond, kAccused));
  range.agreement[kAccused] = kAgrees;
  range.agreement[kSecond] = kContradicts;
  trust_.end_probations(belief_);
  EXPECT_FALSE(robot.is_trusted);
}

// All pairs but those of one robot contradict their ranges: its are the wrong ones.
TEST_F(TrustOfFour, ARobotThatSetAWrongScaleIsFoundOnce) {
  for (auto& [pair, range] : belief_.ranges) {
    const bool has_part = pair.first == kAccused || pair.second == kAccused;
    range.agreement[pair.first] = has_part ? kAgrees : kContradicts;
  }
  EXPECT_TRUE(trust_.note_misleading(belief_));
  EXPECT_FALSE(trust_.note_misleading(belief_));
  TeamRobot& robot = belief_.robots.at(kAccused);
  robot.is_trusted = false;
  wait(2s);
  trust_.end_probations(belief_);
  EXPECT_FALSE(robot.is_trusted) << "it is trusted later than others";
  wait(2s);
  trust_.end_probations(belief_);
  EXPECT_TRUE(robot.is_trusted);
}

// That the second robot is part of all pairs that fit says nothing: one pair is not measured.
TEST_F(TrustOfFour, ARobotWhoseRangesAreAllRefusedShowsNoWrongScale) {
  for (auto& [pair, range] : belief_.ranges) {
    if (pair == ordered(kSelf, kThird)) continue;
    const bool has_part = pair.first == kAccused || pair.second == kAccused;
    range.agreement[pair.first] = has_part ? kContradicts : kAgrees;
  }
  EXPECT_FALSE(trust_.note_misleading(belief_));
}

TEST_F(TrustOfFour, NamesWhatCalibrationsAndRangesShow) {
  TeamCamera& camera = camera_of(kAccused);
  camera.misalignment = Eigen::Vector3d(0.0, 0.0, radians(2.0));
  belief_.P.block<3, 3>(camera.index, camera.index) =
      std::pow(radians(0.1), 2) * Eigen::Matrix3d::Identity();
  camera_of(kSecond).is_refused = true;
  belief_.robots.at(kThird).clock_s = 0.02;
  const Priors& priors = interval_.settings.priors;
  const auto calibrations = calibrations_of(belief_, priors);
  ASSERT_EQ(calibrations.size(), 4U);
  EXPECT_EQ(calibrations[3].cameras[0].state, CameraMisalignment::State::kTurned);
  EXPECT_NEAR(calibrations[3].cameras[0].angle_sigma_rad(), radians(0.1), 1e-9);
  const auto faults = faults_of(belief_, calibrations);
  ASSERT_EQ(faults.size(), 3U);
  EXPECT_EQ(faults[0].kind, TeamFault::Kind::kCameraRefused);
  EXPECT_EQ(faults[1].kind, TeamFault::Kind::kCameraTurned);
  EXPECT_NEAR(faults[1].size, radians(2.0), 1e-9);
  EXPECT_NEAR(faults[1].sigma, radians(0.1), 1e-9);
  EXPECT_EQ(faults[2].kind, TeamFault::Kind::kClock);
  EXPECT_EQ(faults[2].robot, kThird);
}

}  // namespace
}  // namespace crepes::team_trust_test
