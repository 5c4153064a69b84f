#include "estimator/swarm/graph_problem_builder.hpp"

#include <gtest/gtest.h>

#include "tests/support/simulated_pair.hpp"

namespace crepes::graph_problem_builder_test {
namespace {

using namespace std::chrono_literals;
using test::SimulatedPair;

constexpr RobotId kSelf{1};
constexpr RobotId kB{2};
constexpr RobotId kN{3};

SwarmConfig swarm_of(const std::vector<RobotId>& ids) {
  SwarmConfig swarm;
  for (const RobotId id : ids) swarm.members.emplace_back().id = id;
  return swarm;
}
const SwarmConfig kSwarm = swarm_of({kSelf, kB, kN});

/// Robots 2 and 3 are a pair whose IMUs are without fault; 1 only listens.
SimulatedPair exact_pair() {
  SimulatedPair pair(1, {.gyro = 0.0, .accel = 0.0, .priors = {}});
  pair.sample_imus(Timestamp{2s});
  return pair;
}

GraphProblemBuilder::ImuOf imus_of(const SimulatedPair& pair) {
  return [&pair](RobotId robot) -> const ImuHistory* {
    return robot == kB ? &pair.imu_B : robot == kN ? &pair.imu_N : nullptr;
  };
}

Report report_of(const SimulatedPair& pair, Timestamp stamp) {
  const NominalState truth = pair.truth(stamp);
  Report report;
  report.sender = kB;
  report.stamp = stamp;
  report.estimates.push_back(
      {stamp, kN, {truth.motion.T_B_N, 1e-4 * Matrix6d::Identity()}, truth.motion.v_B_N});
  return report;
}

TEST(GraphProblemBuilder, CarriesAnEstimateToAnotherInstantByTheImus) {
  const SimulatedPair pair = exact_pair();
  for (const Duration ahead : {Duration{200ms}, Duration{-200ms}}) {
    const Timestamp stamp = Timestamp{1s} + ahead;
    GraphProblemBuilder builder;
    builder.add_report(report_of(pair, Timestamp{1s}), kSwarm);

    const GraphProblem problem = builder.build(stamp, kSelf, {}, imus_of(pair));

    ASSERT_EQ(problem.edges.size(), 1U);
    const RelativePoseEdge& edge = problem.edges[0];
    EXPECT_EQ(edge.from, kB);
    EXPECT_EQ(edge.to, kN);
    const RelativeMotion truth = pair.truth(stamp).motion;
    EXPECT_LT(pose_difference(truth.T_B_N, edge.T_from_to.pose).norm(), 2e-3);
    EXPECT_LT((truth.v_B_N - edge.v_from_to).norm(), 2e-3);
    // Without carrying it would be off by the motion of a fifth of a second.
    EXPECT_GT(pose_difference(truth.T_B_N, pair.truth(Timestamp{1s}).motion.T_B_N).norm(), 0.05);
    EXPECT_GT(edge.T_from_to.covariance.trace(), 6e-4);
  }
}

TEST(GraphProblemBuilder, KeepsTheNewestEstimateOfAPairHoweverTheyArrive) {
  const SimulatedPair pair = exact_pair();
  GraphProblemBuilder builder;
  builder.add_report(report_of(pair, Timestamp{1s}), kSwarm);
  Report stale = report_of(pair, Timestamp{900ms});
  stale.estimates[0].T_B_N.pose.p.x() += 100.0;

  builder.add_report(stale, kSwarm);

  const GraphProblem problem = builder.build(Timestamp{1s}, kSelf, {}, imus_of(pair));
  ASSERT_EQ(problem.edges.size(), 1U);
  EXPECT_LT(problem.edges[0].T_from_to.pose.p.norm(), 50.0);
}

TEST(GraphProblemBuilder, LeavesOutWhatIsOldOrCannotBeCarried) {
  const SimulatedPair pair = exact_pair();
  GraphProblemBuilder builder;
  builder.add_report(report_of(pair, Timestamp{1s}), kSwarm);

  EXPECT_TRUE(builder.build(Timestamp{1600ms}, kSelf, {}, imus_of(pair)).edges.empty());
  const auto no_imu = [](RobotId) -> const ImuHistory* { return nullptr; };
  EXPECT_TRUE(builder.build(Timestamp{1s}, kSelf, {}, no_imu).edges.empty());
}

TEST(GraphProblemBuilder, RefusesARobotsEstimateOfItself) {
  const SimulatedPair pair = exact_pair();
  Report report = report_of(pair, Timestamp{1s});
  report.estimates[0].neighbor = kB;
  GraphProblemBuilder builder;

  builder.add_report(report, kSwarm);

  EXPECT_TRUE(builder.build(Timestamp{1s}, kSelf, {}, imus_of(pair)).edges.empty());
}

TEST(GraphProblemBuilder, KeepsNoEstimateOfARobotThatIsNoMember) {
  const SimulatedPair pair = exact_pair();
  GraphProblemBuilder builder;

  builder.add_report(report_of(pair, Timestamp{1s}), swarm_of({kSelf, kB}));

  EXPECT_TRUE(builder.build(Timestamp{1s}, kSelf, {}, imus_of(pair)).edges.empty());
}

TEST(GraphProblemBuilder, PutsOwnEstimatesFirstAsTheyAre) {
  const SimulatedPair pair = exact_pair();
  const NominalState truth = pair.truth(Timestamp{1s});
  const std::vector<NeighborEstimate> own{
      {Timestamp{1s}, kB, {truth.motion.T_B_N, Matrix6d::Identity()}, truth.motion.v_B_N}};

  const GraphProblem problem =
      GraphProblemBuilder{}.build(Timestamp{1s}, kSelf, own, imus_of(pair));

  ASSERT_EQ(problem.edges.size(), 1U);
  EXPECT_EQ(problem.self, kSelf);
  EXPECT_EQ(problem.edges[0].from, kSelf);
  EXPECT_EQ(problem.edges[0].T_from_to.pose.p, truth.motion.T_B_N.p);
}

}  // namespace
}  // namespace crepes::graph_problem_builder_test
