/// The filter of a team with a camera that was turned and is right again.
#include <gtest/gtest.h>

#include <cstdint>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/team_filter.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::repaired_camera_test {
namespace {

constexpr RobotId kSeen{2};
constexpr RobotId kTurned{4};
constexpr int kTurnedAt = 30;  // tenths of a second
constexpr int kRightAt = 90;
constexpr int kEnd = 150;

struct Outcome {
  int poses = 0;
  int beyond = 0;          ///< 5 sigma in position
  bool was_named = false;  ///< the camera, while it was turned
};

/// From `kRightAt` on, that camera sees `kSeen` alone, whom one other camera sees.
Outcome outcome(std::uint64_t seed) {
  constexpr double kFiveSigma = 35.0;
  test::SimulatedTeam team(seed);
  const Eigen::Quaterniond turn = so3_exp(radians(8.0) * Eigen::Vector3d(0.0, 0.6, 0.8));
  TeamFilter filter;
  Outcome outcome;
  for (int tenth = 0; tenth < kEnd; ++tenth) {
    const bool is_turned = tenth >= kTurnedAt && tenth < kRightAt;
    team.damage = [&](TeamInterval& interval) {
      for (TeamBearing& b : interval.bearings)
        if (is_turned && b.observer == kTurned) b.bearing.u_B = turn * b.bearing.u_B;
    };
    if (tenth >= kRightAt) {
      team.sees = [](RobotId i, RobotId j) {
        if (i == kTurned) return j == kSeen;
        return j != kSeen || i == RobotId{3};
      };
    }
    const TeamSolution solution = filter.step(team.next());
    for (const TeamFault& fault : solution.faults)
      outcome.was_named = outcome.was_named || (is_turned && fault.robot == kTurned);
    const TeamPose* const pose = test::find(solution, kSeen);
    if (pose == nullptr) continue;
    ++outcome.poses;
    outcome.beyond += test::position_nees_of(*pose, team.truth(kSeen)) > kFiveSigma ? 1 : 0;
  }
  return outcome;
}

// What such a camera says contradicts the one robot that it sees. That robot is in the right place.
TEST(RepairedCamera, MovesNobodyWhomItSeesAlone) {
  constexpr std::uint64_t kSeeds = 20;
  int beyond = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Outcome one = outcome(seed);
    EXPECT_TRUE(one.was_named) << seed << ": or nothing is tested";
    EXPECT_GT(one.poses, kEnd - 50) << seed;
    beyond += one.beyond;
  }
  EXPECT_LE(beyond, 2);
}

}  // namespace
}  // namespace crepes::repaired_camera_test
