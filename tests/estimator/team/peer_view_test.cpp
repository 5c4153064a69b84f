/// What a robot in the dark knows of its team.
#include "estimator/team/peer_view.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::peer_view_test {
namespace {

using test::find;
using test::kIntervalSeconds;
using test::kSelf;
using test::SimulatedTeam;

constexpr RobotId kPeer{2};  // whose frame it is: the first of those that see most
constexpr int kTeams = 8;
constexpr double kSixDof5Sigma = 46.0;  // of six degrees of freedom as likely as 5 sigma of three

/// What is known of the others in so many teams.
struct Known {
  int teams = 0;
  int poses = 0;
  int beyond = 0;
  double square_m2 = 0.0;

  [[nodiscard]] double rmse_m() const { return std::sqrt(square_m2 / std::max(1, poses)); }
};

Known known(int robots, double seconds, const std::function<void(SimulatedTeam&)>& alter) {
  Known all;
  for (std::uint64_t seed = 1; seed <= kTeams; ++seed) {
    SimulatedTeam team(seed, robots);
    PeerView view;
    team.hovers = true;
    team.sees = [](RobotId i, RobotId j) { return i != kSelf && j != kSelf; };
    alter(team);
    bool is_known = false;
    for (double t = 0.0; t < seconds; t += kIntervalSeconds) {
      const auto seen = view.step(team.next(), {});
      if (!seen) continue;
      for (const TeamPose& pose : seen->solution.poses) {
        if (pose.needs_confirmation) continue;
        is_known = true;
        ++all.poses;
        const Pose truth = team.truth(pose.neighbor);
        all.square_m2 += test::error_of(pose, truth).head<3>().squaredNorm();
        if (test::nees_of(pose, truth) > kSixDof5Sigma) ++all.beyond;
      }
    }
    all.teams += is_known ? 1 : 0;
  }
  return all;
}

TEST(PeerView, ShowsARobotInTheDarkItsTeam) {
  const Known all = known(7, 12.0, [](SimulatedTeam&) {});
  EXPECT_GE(all.teams, kTeams - 1);
  EXPECT_LT(all.rmse_m(), 0.5);
  EXPECT_EQ(all.beyond, 0) << "of " << all.poses;
}

TEST(PeerView, ShowsNothingWithFewerThanFour) {
  EXPECT_EQ(known(4, 8.0, [](SimulatedTeam&) {}).poses, 0);
}

TEST(PeerView, EndsWhenTheRobotSeesAndKnowsOthers) {
  SimulatedTeam team(3, 7);
  PeerView view;
  TeamFilter filter;
  const auto is_known = [&] {
    const TeamInterval interval = team.next();
    const bool by_peer = view.step(interval, filter.belief()).has_value();
    (void)filter.step(interval);
    return by_peer;
  };
  team.hovers = true;
  team.sees = [](RobotId i, RobotId j) { return i != kSelf && j != kSelf; };
  bool was_known = false;
  for (double t = 0.0; t < 12.0; t += kIntervalSeconds) was_known = is_known() || was_known;
  EXPECT_TRUE(was_known);
  team.sees = [](RobotId, RobotId) { return true; };
  (void)is_known();  // after which its own filter knows those of whom it has estimates
  EXPECT_FALSE(is_known());
}

// A robot that was seen for some seconds goes on from what it knew then.
TEST(PeerView, GoesOnFromWhatWasKnown) {
  double sum_m2 = 0.0;
  double count = 0.0;
  for (std::uint64_t seed = 1; seed <= kTeams; ++seed) {
    SimulatedTeam team(seed, 7);
    team.hovers = true;
    PeerView view;
    TeamFilter filter;
    for (double t = 0.0; t < 25.0; t += kIntervalSeconds) {
      if (t > 5.0) team.sees = [](RobotId i, RobotId j) { return i != kSelf && j != kSelf; };
      const TeamInterval interval = team.next();
      const auto seen = view.step(interval, filter.belief());
      (void)filter.step(interval);
      if (t < 7.0) continue;
      ASSERT_TRUE(seen) << seed << " at " << t;
      ASSERT_EQ(seen->solution.poses.size(), 6U) << seed << " at " << t;
      for (const TeamPose& pose : seen->solution.poses) {
        const Pose truth = team.truth(pose.neighbor);
        EXPECT_LT(test::nees_of(pose, truth), kSixDof5Sigma) << seed << " at " << t;
        sum_m2 += test::error_of(pose, truth).head<3>().squaredNorm();
        count += 1.0;
      }
    }
  }
  EXPECT_LT(std::sqrt(sum_m2 / count), 0.3);
}

// The peer whose frame it is leaves: what is known goes on in another one's.
TEST(PeerView, GoesOnWithAnotherPeer) {
  SimulatedTeam team(3, 7);
  team.hovers = true;
  PeerView view;
  TeamFilter filter;
  for (double t = 0.0; t < 14.0; t += kIntervalSeconds) {
    if (t > 5.0) team.sees = [](RobotId i, RobotId j) { return i != kSelf && j != kSelf; };
    TeamInterval interval = team.next();
    if (t > 9.0) {
      std::erase_if(interval.members, [](const TeamMember& m) { return m.robot == kPeer; });
    }
    const auto seen = view.step(interval, filter.belief());
    (void)filter.step(interval);
    if (t < 7.0) continue;
    ASSERT_TRUE(seen) << t;
    EXPECT_EQ(seen->solution.poses.size(), t > 9.0 ? 5U : 6U) << t;
    for (const TeamPose& pose : seen->solution.poses) {
      const Pose truth = team.truth(pose.neighbor);
      EXPECT_LT(test::nees_of(pose, truth), kSixDof5Sigma) << t;
      EXPECT_LT(test::error_of(pose, truth).head<3>().norm(), 0.5) << t;
    }
  }
}

// A robot whose cameras see nobody any more goes on in the frame of one that sees it.
TEST(PeerView, ShowsABlindRobotItsTeam) {
  for (std::uint64_t seed = 1; seed <= kTeams; ++seed) {
    SimulatedTeam team(seed, 3);
    team.hovers = true;
    PeerView view;
    TeamFilter filter;
    for (double t = 0.0; t < 30.0; t += kIntervalSeconds) {
      if (t > 3.0) team.sees = [](RobotId i, RobotId) { return i != kSelf; };
      const TeamInterval interval = team.next();
      auto seen = view.step(interval, filter.belief());
      (void)filter.step(interval);
      if (t < 5.0) continue;
      ASSERT_TRUE(seen && seen->belief) << seed << " at " << t;
      for (const TeamPose& pose : seen->solution.poses)
        EXPECT_LT(test::nees_of(pose, team.truth(pose.neighbor)), kSixDof5Sigma)
            << seed << " at " << t;
      EXPECT_EQ(seen->belief->self, kSelf);
      filter.replace(*std::move(seen->belief));
    }
    // It sees again, and its own filter knows as much.
    team.sees = [](RobotId, RobotId) { return true; };
    const TeamInterval interval = team.next();
    EXPECT_FALSE(view.step(interval, filter.belief()));
    const TeamSolution solution = filter.step(interval);
    ASSERT_EQ(solution.poses.size(), 2U);
    for (const TeamPose& pose : solution.poses)
      EXPECT_LT(test::nees_of(pose, team.truth(pose.neighbor)), kSixDof5Sigma) << seed;
  }
}

// The camera of that peer is turned.
TEST(PeerView, IsNotMisledByThePeerWhoseFrameItIs) {
  const Known all = known(7, 15.0, [](SimulatedTeam& team) {
    team.damage = [](TeamInterval& interval) {
      const Eigen::Quaterniond turn = so3_exp(Eigen::Vector3d(0.0, 0.0, radians(20.0)));
      for (TeamBearing& reading : interval.bearings)
        if (reading.observer == kPeer) reading.bearing.u_B = turn * reading.bearing.u_B;
    };
  });
  EXPECT_GE(all.teams, kTeams - 2);
  EXPECT_EQ(all.beyond, 0) << "of " << all.poses;
}

}  // namespace
}  // namespace crepes::peer_view_test
