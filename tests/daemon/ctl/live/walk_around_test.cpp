#include "daemon/ctl/live/walk_around.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "daemon/ctl/live/own_board.hpp"
#include "daemon/ctl/setup/led.hpp"

namespace crepes::walk_around_test {
namespace {

/// Of a neighbor at a place, leaning about x.
client::Pose pose_at(double x, double y, double z, double lean_rad = 0.0) {
  client::Pose pose;
  pose.peer = 2;
  pose.name = "r2";
  pose.position = {x, y, z};
  pose.orientation = {std::cos(0.5 * lean_rad), std::sin(0.5 * lean_rad), 0.0, 0.0};
  pose.up = client::Vector{0.0, 0.0, 1.0};
  return pose;
}

CheckVerdict worst(const std::vector<CheckFinding>& findings) {
  CheckVerdict verdict = CheckVerdict::kGood;
  for (const CheckFinding& finding : findings) {
    EXPECT_EQ(finding.advice.empty(), finding.verdict == CheckVerdict::kGood) << finding.text;
    verdict = std::max(verdict, finding.verdict);
  }
  return verdict;
}

std::string all_of(const std::vector<CheckFinding>& findings) {
  std::string text;
  for (const CheckFinding& finding : findings) text += finding.text + "\n";
  return text;
}

TEST(WalkAround, AcceptsANeighborThatIsWhereItWasPut) {
  EXPECT_EQ(worst(judge_walk(WalkStep::kAhead, pose_at(2.0, 0.1, 0.0, 0.02), 2.0)),
            CheckVerdict::kGood);
  EXPECT_EQ(worst(judge_walk(WalkStep::kLeft, pose_at(1.4, 1.4, 0.0), {})), CheckVerdict::kGood);
  EXPECT_EQ(worst(judge_walk(WalkStep::kRight, pose_at(1.4, -1.4, 0.0), {})), CheckVerdict::kGood);
  EXPECT_EQ(worst(judge_walk(WalkStep::kLifted, pose_at(2.0, 0.0, 0.5), {})), CheckVerdict::kGood);
  EXPECT_EQ(worst(judge_walk(WalkStep::kUpsideDown, pose_at(2.0, 0.0, 0.1, 3.0), {})),
            CheckVerdict::kGood);
}

TEST(WalkAround, SaysThatTheDistanceIsWrong) {
  const auto findings = judge_walk(WalkStep::kAhead, pose_at(2.3, 0.0, 0.0), 2.0);

  EXPECT_EQ(worst(findings), CheckVerdict::kFault);
  EXPECT_NE(all_of(findings).find("distance 2.30 m, by tape 2.00 m"), std::string::npos);
}

TEST(WalkAround, SaysThatSidesOrHeightsAreSwapped) {
  const auto left = judge_walk(WalkStep::kLeft, pose_at(1.4, -1.4, 0.0), {});
  const auto right = judge_walk(WalkStep::kRight, pose_at(1.4, 1.4, 0.0), {});
  const auto lifted = judge_walk(WalkStep::kLifted, pose_at(2.0, 0.0, -0.5), {});

  for (const auto& findings : {left, right, lifted}) {
    EXPECT_EQ(worst(findings), CheckVerdict::kFault);
    EXPECT_NE(all_of(findings).find("swapped"), std::string::npos) << all_of(findings);
  }
}

TEST(WalkAround, SaysThatGravityAndBearingsDisagree) {
  const auto findings = judge_walk(WalkStep::kAhead, pose_at(2.0, 0.0, 0.0, 0.2), {});

  EXPECT_EQ(worst(findings), CheckVerdict::kFault);
  EXPECT_NE(all_of(findings).find("leans by 11.5 deg"), std::string::npos) << all_of(findings);
}

TEST(WalkAround, SaysThatANeighborThatWasTurnedOverSeemsUpright) {
  EXPECT_EQ(worst(judge_walk(WalkStep::kUpsideDown, pose_at(2.0, 0.0, 0.0), {})),
            CheckVerdict::kFault);
}

TEST(WalkAround, LeadsThroughAllStepsAndSkipsSome) {
  std::istringstream keys("\n\ns\n\n\n");
  std::ostringstream prompts;
  int asked = 0;
  const auto findings = walk_around(
      "r2", 2.0,
      [&]() -> std::optional<client::Pose> {
        return ++asked == 4 ? std::nullopt : std::optional(pose_at(2.0, 0.1, 0.0));
      },
      keys, prompts);

  EXPECT_EQ(asked, 4);
  EXPECT_NE(prompts.str().find("2.00 m away"), std::string::npos);
  EXPECT_NE(all_of(findings).find("no pose of r2"), std::string::npos);
  for (const CheckFinding& finding : findings) EXPECT_EQ(finding.about, "walk");
}

TEST(WalkAround, DoubtsAWalkOfNoSteps) {
  std::istringstream nothing;
  std::ostringstream prompts;

  const auto findings = walk_around(
      "r2", {}, [] { return std::nullopt; }, nothing, prompts);

  EXPECT_EQ(worst(findings), CheckVerdict::kDoubt);
}

SwarmConfig two_members() {
  SwarmConfig swarm;
  for (const std::uint16_t id : {1, 2}) {
    MemberConfig member;
    member.id = RobotId{id};
    member.name = "r" + std::to_string(id);
    member.pattern = id == 1 ? "011111111111111111" : "001001011111111111";
    swarm.members.push_back(member);
  }
  return swarm;
}

TEST(OwnBoard, IsComparedWithTheLibrary) {
  const SwarmConfig swarm = two_members();
  const led_settings own = led_settings_of(swarm, RobotId{1}, {100}).value();
  const led_settings other = led_settings_of(swarm, RobotId{2}, {100}).value();
  led_settings wrong_pattern = other;
  wrong_pattern.robot_id = 1;
  led_settings slow = own;
  slow.lit_ticks = slow.dark_ticks = static_cast<std::uint16_t>(2 * slow.lit_ticks);
  const auto judged = [&](const led_settings& board) {
    return judge_own_board(board, swarm, RobotId{1}, "/dev/ttyUSB2");
  };

  EXPECT_EQ(judged(own).verdict, CheckVerdict::kGood);
  EXPECT_NE(judged(other).text.find("code of robot 2"), std::string::npos);
  EXPECT_NE(judged(wrong_pattern).text.find("another pattern"), std::string::npos);
  EXPECT_NE(judged(slow).text.find("another pace"), std::string::npos);
  EXPECT_NE(judged(led_settings_unset()).text.find("never set"), std::string::npos);
  EXPECT_NE(judged(other).advice.find("--port /dev/ttyUSB2 set --id 1"), std::string::npos);
}

}  // namespace
}  // namespace crepes::walk_around_test
