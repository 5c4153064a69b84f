/// Robots whose heading is open, on arcs about those that they see.
#include "estimator/team/belief/team_arcs.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <vector>

#include "estimator/team/team_filter.hpp"
#include "tests/support/random_geometry.hpp"
#include "tests/support/simulated_belief.hpp"
#include "tests/support/simulated_team.hpp"
#include "tests/support/team_solution.hpp"

namespace crepes::team_arcs_test {
namespace {

using test::kSelf;
using test::RandomGeometry;
using test::SimulatedTeam;

constexpr RobotId kSecond{2};
constexpr RobotId kThird{3};

/// What an unknown turn about another robot does to [p, v, theta].
Eigen::Matrix<double, 9, 3> by_turn(const FreeMotion& motion, const FreeMotion& about) {
  Eigen::Matrix<double, 9, 3> by;
  by << -hat(motion.p_F - about.p_F), -hat(motion.v_F - about.v_F), motion.R().transpose();
  return by;
}

MotionMatrix on_arc(const FreeMotion& motion, const FreeMotion& about, double turn_rad) {
  const auto by = by_turn(motion, about);
  return 1e-5 * MotionMatrix::Identity() + turn_rad * turn_rad * by * by.transpose();
}

/// The second one is on an arc about this robot, and the third one about the second.
TeamBelief line(std::uint64_t seed, double turn_rad) {
  SimulatedTeam team(seed, 3);
  (void)team.next();
  const test::TrueMotions motions = test::motions_of(team);
  TeamBelief belief = test::true_belief(motions, team.next());
  const FreeMotion& second = motions.at(kSecond);
  const FreeMotion& third = motions.at(kThird);
  belief.place(kSecond, second, on_arc(second, {}, turn_rad));
  MotionMatrix carried = MotionMatrix::Identity();
  carried.bottomRows<3>().setZero();
  belief.place(kThird, third, MotionMatrix::Identity());
  belief.connect(kThird, kSecond, carried, on_arc(third, second, turn_rad));
  return belief;
}

TeamBelief moved(TeamBelief belief, const TeamArcs& arcs, const Eigen::VectorXd& dx) {
  belief.inject(dx + arcs.off_tangent(dx));
  return belief;
}

/// Of all states that both beliefs have.
Eigen::VectorXd difference(const TeamBelief& from, const TeamBelief& to) {
  Eigen::VectorXd d = Eigen::VectorXd::Zero(from.P.rows());
  for (const RobotId id : {kSecond, kThird}) {
    const TeamRobot& a = from.robots.at(id);
    const TeamRobot& b = to.robots.at(id);
    d.segment<9>(a.motion_index) << b.motion.p_F - a.motion.p_F, b.motion.v_F - a.motion.v_F,
        so3_log(a.motion.q_F_B.conjugate() * b.motion.q_F_B);
  }
  return d;
}

/// Of the motions alone.
Eigen::VectorXd random_step(const TeamBelief& belief, RandomGeometry& random, double size) {
  Eigen::VectorXd dx = Eigen::VectorXd::Zero(belief.P.rows());
  for (const RobotId id : {kSecond, kThird})
    dx.segment<9>(belief.robots.at(id).motion_index) = random.normal_vector<9>(size);
  return dx;
}

TEST(TeamArcs, OpenAttitudesTurnAboutWhatTheirRobotsSee) {
  const TeamBelief belief = line(1, 0.1);
  const TeamArcs arcs(belief);
  EXPECT_TRUE(arcs.contains(belief.robots.at(kSecond).motion_index));
  EXPECT_TRUE(arcs.contains(belief.robots.at(kThird).motion_index));
  EXPECT_TRUE(TeamArcs(line(1, 0.005)).empty());
  std::vector<bool> corrected(static_cast<std::size_t>(belief.P.rows()), false);
  EXPECT_TRUE(TeamArcs(belief, corrected).empty());
}

// A turn of the second one alone leaves its distance to this robot, and carries the third one along
// as it is turned.
TEST(TeamArcs, AreCircles) {
  const TeamBelief belief = line(2, 0.2);
  const TeamArcs arcs(belief);
  const FreeMotion& second = belief.robots.at(kSecond).motion;
  const FreeMotion& third = belief.robots.at(kThird).motion;
  const Eigen::Vector3d phi(0.1, -0.2, 0.4);
  Eigen::VectorXd dx = Eigen::VectorXd::Zero(belief.P.rows());
  dx.segment<9>(belief.robots.at(kSecond).motion_index) = by_turn(second, {}) * phi;
  dx.segment<3>(belief.robots.at(kThird).motion_index) = phi.cross(second.p_F);
  const TeamBelief turned = moved(belief, arcs, dx);
  EXPECT_TRUE(turned.robots.at(kSecond).motion.p_F.isApprox(so3_exp(phi) * second.p_F, 1e-9));
  EXPECT_TRUE(turned.robots.at(kThird).motion.p_F.isApprox(
      so3_exp(phi) * second.p_F + third.p_F - second.p_F, 1e-9));
  EXPECT_TRUE(turned.robots.at(kThird).motion.q_F_B.isApprox(third.q_F_B));
}

TEST(TeamArcs, CarryErrorsAsDifferencesSay) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const TeamBelief belief = line(seed, 0.2);
    const TeamArcs arcs(belief);
    RandomGeometry random(seed);
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(belief.P.rows());
    const Eigen::VectorXd there = random_step(belief, random, 0.3);
    const Eigen::VectorXd beyond = random_step(belief, random, 0.3);
    const Eigen::VectorXd error = random_step(belief, random, 1e-7);
    const Eigen::VectorXd expected =
        difference(moved(belief, arcs, there), moved(belief, arcs, there + error));
    const Eigen::VectorXd carried = arcs.carried(error, none, there);
    EXPECT_LT((carried - expected).norm(), 1e-5 * expected.norm()) << seed;
    const Eigen::VectorXd onwards = arcs.carried(carried, there, beyond);
    EXPECT_TRUE(onwards.isApprox(arcs.carried(error, none, beyond), 1e-9)) << seed;
    Eigen::MatrixXd P = error * error.transpose();
    arcs.carry(none, there, P);
    EXPECT_TRUE(P.isApprox(carried * carried.transpose(), 1e-9)) << seed;
  }
}

// Against draws. Bends last, so they weigh a hundred times in a range.
TEST(TeamArcs, BendsAndCurvaturesAreThoseOfDraws) {
  constexpr int kDraws = 20000;
  constexpr double kLasting = 100.0;
  const TeamBelief belief = line(3, 0.1);
  const TeamArcs arcs(belief);
  const int second = belief.robots.at(kSecond).motion_index;
  const int third = belief.robots.at(kThird).motion_index;
  Eigen::MatrixXd P = belief.P;
  P.diagonal().array() += 1e-12;
  const Eigen::MatrixXd L = P.llt().matrixL();
  RandomGeometry random(3);
  Eigen::Matrix<double, 6, 1> mean = Eigen::Matrix<double, 6, 1>::Zero();
  Matrix6d square = Matrix6d::Zero();
  const Eigen::Vector3d p_third = belief.robots.at(kThird).motion.p_F;
  double longer = 0.0;
  double longer2 = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    Eigen::VectorXd z(P.rows());
    for (double& x : z) x = random.normal();
    const Eigen::VectorXd dx = L * z;
    const Eigen::VectorXd off = arcs.off_tangent(dx);
    const Vector6d of_third = off.segment<6>(third);
    mean += of_third / kDraws;
    square += of_third * of_third.transpose() / kDraws;
    const Eigen::Vector3d p = p_third + dx.segment<3>(third) + off.segment<3>(third);
    const double rest = p.norm() - p_third.norm() - p_third.normalized().dot(dx.segment<3>(third));
    longer += rest / kDraws;
    longer2 += rest * rest / kDraws;
    const Eigen::Vector3d p_second = belief.robots.at(kSecond).motion.p_F;
    ASSERT_NEAR((p_second + dx.segment<3>(second) + off.segment<3>(second)).norm(), p_second.norm(),
                0.05);
  }
  const Bend bend = arcs.bend(belief, kThird);
  const Matrix6d covariance = square - mean * mean.transpose();
  EXPECT_LT((bend.mean - mean).norm(), 0.1 * mean.norm());
  EXPECT_LT((bend.covariance - covariance).norm(), 0.15 * covariance.norm());

  const RelativeSpread spread = arcs.spread(belief, kSelf, kThird);
  const RangeCurvature curvature = spread.curvature(p_third.normalized(), p_third.norm());
  const double variance = longer2 - longer * longer;
  EXPECT_NEAR(curvature.mean_m, longer, 0.1 * std::abs(longer) + 2e-4);
  EXPECT_NEAR(curvature.variance_m2, kLasting * variance, 0.2 * kLasting * variance);
}

// A turn about this robot changes no range to it.
TEST(TeamArcs, HaveNoCurvatureAboutTheirPivot) {
  const TeamBelief belief = line(4, 0.2);
  const Eigen::Vector3d p = belief.robots.at(kSecond).motion.p_F;
  const auto mean_m = [&](const TeamArcs& arcs) {
    return arcs.spread(belief, kSelf, kSecond).curvature(p.normalized(), p.norm()).mean_m;
  };
  EXPECT_LT(std::abs(mean_m(TeamArcs(belief))), 1e-3);
  EXPECT_GT(mean_m(TeamArcs()), 0.1);
}

/// Robots in a line, each of which sees the one in front alone. First estimates err by this turn
/// about the vertical.
class Line {
 public:
  Line(std::uint64_t seed, int count, double turn_rad)
      : team(seed, count), random_(seed + 77), turn_rad_(turn_rad) {
    team.hovers = true;
    team.sees = [](RobotId a, RobotId b) { return a.value == b.value + 1; };
    team.damage = [this](TeamInterval& interval) { start(interval); };
  }

  SimulatedTeam team;

 private:
  void start(TeamInterval& interval) {
    interval.edges.clear();
    if (std::exchange(has_started_, true)) return;
    for (const RobotId to : team.robots()) {
      if (to == kSelf) continue;
      const RobotId from{static_cast<std::uint16_t>(to.value - 1)};
      const Pose T_S_from = from == kSelf ? Pose{} : team.truth(from);
      const Pose T = T_S_from.inverse() * team.truth(to);
      const Eigen::Vector3d up = T_S_from.q.conjugate() * team.up();
      const Eigen::Quaterniond turn = so3_exp(random_.normal(turn_rad_) * up);
      const Pose turned{turn * T.p, turn * T.q};
      Vector6d by_turn;
      by_turn << up.cross(turned.p), turned.q.conjugate() * up;
      const Matrix6d small = 1e-4 * Matrix6d::Identity();
      const Matrix6d covariance = small + turn_rad_ * turn_rad_ * by_turn * by_turn.transpose();
      interval.edges.push_back({from,
                                to,
                                {perturbed(turned, random_.draw<6>(small)), covariance},
                                Eigen::Vector3d::Zero(),
                                interval.to});
    }
  }

  RandomGeometry random_;
  double turn_rad_;
  bool has_started_ = false;
};

double heading_sigma_rad(const TeamBelief& belief, RobotId id, const Eigen::Vector3d& up) {
  const GaussianPose T_S_N = belief.pose(id);
  const Eigen::Vector3d axis = T_S_N.pose.q.conjugate() * up;
  return std::sqrt(axis.dot(T_S_N.covariance.bottomRightCorner<3, 3>() * axis));
}

// Neither its bearings nor ranges depend on the heading that others see it with.
TEST(TeamFilter, AtRestWhatARobotSeesSaysNothingOfItsHeading) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Line line(seed, 2, radians(10.0));
    line.team.rests = true;
    line.team.hovers = false;
    TeamFilter filter;
    (void)test::solution_after(line.team, filter, 4.0);
    EXPECT_GT(heading_sigma_rad(filter.belief(), kSecond, line.team.up()), radians(9.5)) << seed;
  }
}

TEST(TeamFilter, FindsTheHeadingsOfALineAndSaysHowWell) {
  constexpr int kSeeds = 60;
  double nees = 0.0;
  int count = 0;
  int beyond = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    Line line(seed, 4, radians(8.0));
    TeamFilter filter;
    for (const double seconds : {0.5, 1.0, 0.5, 0.5, 1.0, 1.5}) {
      const TeamSolution solution = test::solution_after(line.team, filter, seconds);
      for (const TeamPose& pose : solution.poses) {
        const Pose truth = line.team.truth(pose.neighbor);
        nees += test::nees_of(pose, truth);
        beyond += test::position_nees_of(pose, truth) > 35.0 ? 1 : 0;
        ++count;
      }
    }
    for (const RobotId id : {kSecond, kThird, RobotId{4}})
      EXPECT_LT(heading_sigma_rad(filter.belief(), id, line.team.up()), radians(2.0)) << seed;
  }
  EXPECT_GT(count, 6 * 3 * kSeeds * 9 / 10);
  EXPECT_LT(nees / count, 7.2);
  EXPECT_LE(beyond, count / 200);
}

}  // namespace
}  // namespace crepes::team_arcs_test
