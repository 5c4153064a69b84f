#include "estimator/graph/pose_graph.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "tests/support/random_geometry.hpp"

namespace crepes::pose_graph_test {
namespace {

using test::RandomGeometry;

constexpr RobotId kSelf{1};

GraphConfig lie() { return {.cost = GraphCost::kLie}; }
GraphConfig paper() { return {.cost = GraphCost::kPaper, .max_iterations = 100}; }

/// Robots 1..n with poses and velocities in a world.
struct TrueTeam {
  std::map<RobotId, Pose> T_W;
  std::map<RobotId, Eigen::Vector3d> v_W;

  TrueTeam(RandomGeometry& random, int size) {
    for (int i = 1; i <= size; ++i) {
      T_W.emplace(RobotId{static_cast<std::uint16_t>(i)}, random.pose());
      v_W.emplace(RobotId{static_cast<std::uint16_t>(i)}, random.vector());
    }
  }
  [[nodiscard]] Pose relative(RobotId from, RobotId to) const {
    return T_W.at(from).inverse() * T_W.at(to);
  }
  [[nodiscard]] Eigen::Vector3d velocity(RobotId from, RobotId to) const {
    return T_W.at(from).q.conjugate() * (v_W.at(to) - v_W.at(from));
  }
  [[nodiscard]] RelativePoseEdge edge(int from, int to, double sigma = 0.05) const {
    const RobotId i{static_cast<std::uint16_t>(from)};
    const RobotId j{static_cast<std::uint16_t>(to)};
    return {i, j, {relative(i, j), sigma * sigma * Matrix6d::Identity()}, velocity(i, j)};
  }
};

Vector6d error_of(const GraphPose& pose, const TrueTeam& team) {
  return pose_difference(team.relative(kSelf, pose.neighbor), pose.T_B_N.pose);
}

const GraphPose* find(const GraphSolution& solution, RobotId robot) {
  for (const GraphPose& pose : solution.poses) {
    if (pose.neighbor == robot) return &pose;
  }
  return nullptr;
}

RelativePoseEdge disturbed(RelativePoseEdge edge, RandomGeometry& random) {
  edge.T_from_to.pose = perturbed(edge.T_from_to.pose, random.draw<6>(edge.T_from_to.covariance));
  return edge;
}

GraphProblem noisy(GraphProblem problem, RandomGeometry& random) {
  for (RelativePoseEdge& edge : problem.edges) edge = disturbed(edge, random);
  return problem;
}

/// A random tree over the team, in random directions, and some edges more.
GraphProblem connected_problem(const TrueTeam& team, RandomGeometry& random) {
  GraphProblem problem{.stamp = {}, .self = kSelf, .edges = {}};
  const int size = static_cast<int>(team.T_W.size());
  const auto add = [&](int a, int b) {
    if (random.index(2) == 0) std::swap(a, b);
    problem.edges.push_back(team.edge(a, b));
  };
  for (int i = 2; i <= size; ++i) add(i, 1 + random.index(i - 1));
  for (int i = 0; i < size; ++i) {
    const int a = 1 + random.index(size);
    const int b = 1 + random.index(size);
    if (a != b) add(a, b);
  }
  return problem;
}

class PoseGraphCost : public testing::TestWithParam<GraphCost> {};

TEST_P(PoseGraphCost, RecoversAnyTeamFromAnyConnectedSetOfExactEdges) {
  const GraphConfig config = GetParam() == GraphCost::kLie ? lie() : paper();
  RandomGeometry random(1);
  for (int run = 0; run < 30; ++run) {
    const TrueTeam team(random, 2 + random.index(6));

    const GraphSolution solution = solve_pose_graph(connected_problem(team, random), config);

    ASSERT_EQ(solution.poses.size(), team.T_W.size() - 1);
    EXPECT_NEAR(solution.cost, 0.0, 1e-12);
    for (const GraphPose& pose : solution.poses) {
      EXPECT_LT(error_of(pose, team).norm(), 1e-6);
      EXPECT_LT((pose.v_B_N - team.velocity(kSelf, pose.neighbor)).norm(), 1e-6);
      EXPECT_NE(pose.neighbor, kSelf);
    }
  }
}

TEST(PoseGraph, AveragesTheNoiseOfManyEdges) {
  RandomGeometry random(2);
  double single = 0.0;
  double solved = 0.0;
  for (int run = 0; run < 30; ++run) {
    const TrueTeam team(random, 5);
    GraphProblem problem{.stamp = {}, .self = kSelf, .edges = {}};
    for (int i = 1; i <= 5; ++i) {
      for (int j = i + 1; j <= 5; ++j) problem.edges.push_back(disturbed(team.edge(i, j), random));
    }

    const GraphSolution solution = solve_pose_graph(problem, lie());

    single += pose_difference(team.relative(kSelf, RobotId{2}), problem.edges[0].T_from_to.pose)
                  .squaredNorm();
    solved += error_of(*find(solution, RobotId{2}), team).squaredNorm();
  }

  // A full graph of five: attitude gains most, position is what far robots' attitudes leave of it.
  EXPECT_LT(solved, 0.9 * single);
}

INSTANTIATE_TEST_SUITE_P(Both, PoseGraphCost, testing::Values(GraphCost::kLie, GraphCost::kPaper));

TEST(PoseGraph, ReachesARobotThatIsHiddenFromSelfThroughTwoOthers) {
  RandomGeometry random(3);
  const TrueTeam team(random, 4);
  const GraphProblem problem{
      .stamp = {}, .self = kSelf, .edges = {team.edge(1, 2), team.edge(3, 2), team.edge(3, 4)}};

  const GraphSolution solution = solve_pose_graph(problem, lie());

  const GraphPose* hidden = find(solution, RobotId{4});
  ASSERT_NE(hidden, nullptr);
  EXPECT_LT(error_of(*hidden, team).norm(), 1e-6);
  EXPECT_GT(hidden->T_B_N.covariance.trace(), find(solution, RobotId{2})->T_B_N.covariance.trace());
}

TEST(PoseGraph, ARobotThatNoEdgeReachesIsAbsent) {
  RandomGeometry random(4);
  const TrueTeam team(random, 5);
  const GraphProblem problem{
      .stamp = {}, .self = kSelf, .edges = {team.edge(1, 2), team.edge(4, 5)}};

  const GraphSolution solution = solve_pose_graph(problem, lie());

  ASSERT_EQ(solution.poses.size(), 1U);
  EXPECT_EQ(solution.poses[0].neighbor, RobotId{2});
}

TEST(PoseGraph, NoEdgesGiveNoPoses) {
  EXPECT_TRUE(solve_pose_graph({.stamp = {}, .self = kSelf, .edges = {}}, lie()).poses.empty());
}

TEST(PoseGraph, TwoEdgesOverOnePairWeighAsOne) {
  RandomGeometry random(5);
  const TrueTeam team(random, 3);
  const RelativePoseEdge forward = disturbed(team.edge(1, 2), random);
  const GraphProblem once{
      .stamp = {}, .self = kSelf, .edges = {forward, team.edge(2, 3), team.edge(1, 3)}};
  GraphProblem twice = once;
  twice.edges.push_back(forward);

  const GraphSolution one = solve_pose_graph(once, lie());
  const GraphSolution two = solve_pose_graph(twice, lie());

  ASSERT_EQ(one.poses.size(), two.poses.size());
  for (std::size_t i = 0; i < one.poses.size(); ++i) {
    // The kernel bends each half less than the whole; at this noise by next to nothing.
    EXPECT_LT(pose_difference(one.poses[i].T_B_N.pose, two.poses[i].T_B_N.pose).norm(), 0.02);
    EXPECT_NEAR(one.poses[i].T_B_N.covariance.trace() / two.poses[i].T_B_N.covariance.trace(), 1.0,
                0.25);
  }
}

TEST(PoseGraph, TheKernelBendsAnOutlier) {
  RandomGeometry random(6);
  const TrueTeam team(random, 4);
  GraphProblem problem{.stamp = {}, .self = kSelf, .edges = {}};
  for (int i = 1; i <= 4; ++i) {
    for (int j = i + 1; j <= 4; ++j) problem.edges.push_back(team.edge(i, j));
  }
  RelativePoseEdge& outlier = problem.edges.back();
  outlier.T_from_to.pose.p += Eigen::Vector3d(2.0, 0.0, 0.0);

  const GraphSolution solution = solve_pose_graph(problem, lie());

  GraphConfig stiff = lie();
  stiff.kernel_scale = 100.0;
  const GraphSolution mean = solve_pose_graph(problem, stiff);
  for (std::size_t i = 1; i < 3; ++i) {  // both robots of the outlier
    const double bent = error_of(solution.poses[i], team).norm();
    EXPECT_LT(bent, 0.05);
    EXPECT_LT(bent, 0.5 * error_of(mean.poses[i], team).norm());
  }
}

/// Variances of the solution over those found in `kSolves` draws of the edges.
std::vector<double> claimed_over_sampled(const GraphProblem& exact, const TrueTeam& team) {
  RandomGeometry random(7);
  constexpr int kSolves = 300;
  std::map<RobotId, Vector6d> sampled;
  for (int i = 0; i < kSolves; ++i) {
    for (const GraphPose& pose : solve_pose_graph(noisy(exact, random), lie()).poses) {
      sampled.try_emplace(pose.neighbor, Vector6d::Zero()).first->second +=
          error_of(pose, team).cwiseAbs2() / kSolves;
    }
  }
  std::vector<double> ratios;
  for (const GraphPose& pose : solve_pose_graph(exact, lie()).poses) {
    for (int i = 0; i < 6; ++i)
      ratios.push_back(pose.T_B_N.covariance(i, i) / sampled.at(pose.neighbor)(i));
  }
  return ratios;
}

// A variance from 300 draws scatters by 8 %: four sigma.
constexpr double kScatter = 0.33;

TEST(PoseGraph, CovarianceAlongAChainMatchesAMonteCarlo) {
  RandomGeometry random(7);
  const TrueTeam team(random, 4);
  const GraphProblem chain{
      .stamp = {},
      .self = kSelf,
      .edges = {team.edge(1, 2, 0.02), team.edge(3, 2, 0.03), team.edge(3, 4, 0.02)}};

  for (const double ratio : claimed_over_sampled(chain, team)) EXPECT_NEAR(ratio, 1.0, kScatter);
}

TEST(PoseGraph, AroundLoopsCovarianceIsNotBelowAMonteCarlos) {
  RandomGeometry random(7);
  const TrueTeam team(random, 4);
  const GraphProblem loops{
      .stamp = {},
      .self = kSelf,
      .edges = {team.edge(1, 2, 0.02), team.edge(2, 3, 0.03), team.edge(3, 1, 0.02),
                team.edge(3, 4, 0.02), team.edge(2, 4, 0.02)}};

  for (const double ratio : claimed_over_sampled(loops, team)) EXPECT_GT(ratio, 1.0 - kScatter);
}

class UselessEdge : public testing::TestWithParam<RelativePoseEdge (*)(RelativePoseEdge)> {};

TEST_P(UselessEdge, LeavesTheRestAsItWas) {
  RandomGeometry random(8);
  const TrueTeam team(random, 4);
  GraphProblem problem{
      .stamp = {}, .self = kSelf, .edges = {team.edge(1, 2), team.edge(2, 3), team.edge(1, 3)}};
  RelativePoseEdge over_a_known_pair = GetParam()(team.edge(1, 2));
  RelativePoseEdge to_another = GetParam()(team.edge(2, 4));
  const GraphSolution clean = solve_pose_graph(problem, lie());

  problem.edges.insert(problem.edges.begin(), over_a_known_pair);
  problem.edges.push_back(to_another);
  const GraphSolution solution = solve_pose_graph(problem, lie());

  ASSERT_EQ(solution.poses.size(), 2U);  // robot 4 hangs on a useless edge alone
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT(error_of(solution.poses[i], team).norm(), 1e-6);
    EXPECT_LT((solution.poses[i].T_B_N.covariance - clean.poses[i].T_B_N.covariance).norm(), 1e-9);
    EXPECT_LT((solution.poses[i].v_B_N - clean.poses[i].v_B_N).norm(), 1e-6);
  }
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(Each, UselessEdge,
                         testing::Values(
                             [](RelativePoseEdge e) {  // no covariance at all, and a wrong pose
                               e.T_from_to.pose.p.x() += 5.0;
                               e.T_from_to.covariance.setZero();
                               return e;
                             },
                             [](RelativePoseEdge e) {  // singular
                               e.T_from_to.pose.p.x() += 5.0;
                               e.T_from_to.covariance(2, 2) = 0.0;
                               return e;
                             },
                             [](RelativePoseEdge e) {
                               e.T_from_to.covariance(1, 1) = kNan;
                               return e;
                             },
                             [](RelativePoseEdge e) {
                               e.T_from_to.covariance *= -1.0;
                               return e;
                             },
                             [](RelativePoseEdge e) {
                               e.T_from_to.pose.p.y() = kNan;
                               return e;
                             },
                             [](RelativePoseEdge e) {
                               e.T_from_to.pose.q.z() = kNan;
                               return e;
                             },
                             [](RelativePoseEdge e) {
                               e.v_from_to.x() = kNan;
                               return e;
                             }));

TEST(PoseGraph, GivesTheSameToTheBit) {
  RandomGeometry random(9);
  const TrueTeam team(random, 6);
  const GraphProblem problem = noisy(connected_problem(team, random), random);

  const GraphSolution a = solve_pose_graph(problem, lie());
  const GraphSolution b = solve_pose_graph(problem, lie());

  ASSERT_EQ(a.poses.size(), b.poses.size());
  EXPECT_EQ(a.cost, b.cost);
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(a.poses[i].T_B_N.pose.p, b.poses[i].T_B_N.pose.p);
    EXPECT_EQ(a.poses[i].T_B_N.pose.q.coeffs(), b.poses[i].T_B_N.pose.q.coeffs());
    EXPECT_EQ(a.poses[i].T_B_N.covariance, b.poses[i].T_B_N.covariance);
  }
}

}  // namespace
}  // namespace crepes::pose_graph_test
