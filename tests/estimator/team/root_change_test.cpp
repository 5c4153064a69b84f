/// A belief in the frame of another robot.
#include "estimator/team/belief/root_change.hpp"

#include <gtest/gtest.h>

#include "tests/support/simulated_belief.hpp"

namespace crepes::root_change_test {
namespace {

using test::kSelf;

constexpr RobotId kOther{3};

/// A team whose clocks differ.
TeamBelief belief_of(std::uint64_t seed) {
  test::SimulatedTeam team(seed, 5);
  (void)team.next();
  const test::TrueMotions motions = test::motions_of(team);
  TeamBelief belief = test::true_belief(motions, team.next());
  test::RandomGeometry random(seed);
  for (auto& [id, robot] : belief.robots)
    if (id != kSelf) robot.clock_s = 1e-2 * random.normal(1.0);
  return belief;
}

/// [p, v, theta] of b relative to a.
Eigen::Matrix<double, 9, 1> difference(const FreeMotion& a, const FreeMotion& b) {
  Eigen::Matrix<double, 9, 1> d;
  d << b.p_F - a.p_F, b.v_F - a.v_F, so3_log(a.q_F_B.conjugate() * b.q_F_B);
  return d;
}

Eigen::VectorXd random_step(const TeamBelief& belief, std::uint64_t seed) {
  test::RandomGeometry random(seed);
  Eigen::VectorXd dx(belief.P.rows());
  for (double& x : dx) x = random.normal(1e-7);
  dx(belief.robots.at(kSelf).clock_index()) = 0.0;
  return dx;
}

TEST(SeenFrom, CarriesErrorsAsDifferencesSay) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    TeamBelief belief = belief_of(seed);
    const Eigen::VectorXd dx = random_step(belief, seed + 100);
    belief.P = dx * dx.transpose();
    TeamBelief seen = seen_from(kOther, belief);
    belief.inject(dx);
    const TeamBelief moved = seen_from(kOther, belief);
    // The states that are left as they are, and those that change.
    Eigen::VectorXd d = dx;
    for (const auto& [id, robot] : seen.robots) {
      if (id == kOther) continue;
      d.segment<9>(robot.motion_index) = difference(robot.motion, moved.robots.at(id).motion);
      d(robot.clock_index()) = moved.robots.at(id).clock_s - robot.clock_s;
    }
    const int own_clock = seen.robots.at(kOther).clock_index();
    d(own_clock) = 0.0;
    seen.P(own_clock, own_clock) -= TeamBelief::kLeastVariance;
    const Eigen::MatrixXd expected = d * d.transpose();
    EXPECT_LT((seen.P - expected).norm(), 1e-5 * expected.norm()) << seed;
  }
}

TEST(SeenFrom, IsUndoneByTheOldRoot) {
  const TeamBelief belief = belief_of(7);
  const TeamBelief back = seen_from(kSelf, seen_from(kOther, belief));
  for (const auto& [id, robot] : belief.robots) {
    EXPECT_LT(difference(robot.motion, back.robots.at(id).motion).norm(), 1e-12) << id.value;
    EXPECT_NEAR(robot.clock_s, back.robots.at(id).clock_s, 1e-15);
    if (id == kSelf) continue;
    const Eigen::Matrix<double, 9, 9> before =
        belief.P.block<9, 9>(robot.motion_index, robot.motion_index);
    const int index = back.robots.at(id).motion_index;
    const Eigen::Matrix<double, 9, 9> after = back.P.block<9, 9>(index, index);
    EXPECT_LT((before - after).norm(), 1e-9 * before.norm()) << id.value;
  }
}

}  // namespace
}  // namespace crepes::root_change_test
