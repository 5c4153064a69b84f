#include "estimator/graph/pose_graph.hpp"

#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "estimator/graph/pose_manifold.hpp"
#include "estimator/graph/relative_pose_factor.hpp"
#include "estimator/graph/spanning_tree.hpp"
#include "estimator/graph/team_velocity.hpp"

namespace crepes {
namespace {

// The paper's cost has no sigmas: the error of an entry that counts as one.
constexpr double kFrobeniusSigma = 0.1;

using Parameters = std::array<double, kPoseParameters>;
using Nodes = std::map<RobotId, Parameters>;

Parameters to_parameters(const Pose& pose) {
  return {pose.p.x(), pose.p.y(), pose.p.z(), pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()};
}

Pose to_pose(const Parameters& x) {
  return {{x[0], x[1], x[2]}, Eigen::Quaterniond(x[6], x[3], x[4], x[5]).normalized()};
}

// Finite, between two robots and with a covariance that can weigh it.
bool is_usable(const RelativePoseEdge& edge) {
  const GaussianPose& T = edge.T_from_to;
  return edge.from != edge.to && T.pose.p.allFinite() && edge.v_from_to.allFinite() &&
         std::abs(T.pose.q.norm() - 1.0) < 1e-3 && T.covariance.allFinite() &&
         Eigen::LLT<Matrix6d>(T.covariance).info() == Eigen::Success;
}

// L of L^T L = covariance^-1, with the covariance that makes all edges over one pair weigh as one.
Matrix6d weight(const RelativePoseEdge& edge, const std::vector<RelativePoseEdge>& edges) {
  const auto same_pair = [&](const RelativePoseEdge& other) {
    return (other.from == edge.from && other.to == edge.to) ||
           (other.from == edge.to && other.to == edge.from);
  };
  const auto count = static_cast<double>(std::count_if(edges.begin(), edges.end(), same_pair));
  const Eigen::LLT<Matrix6d> chol(count * edge.T_from_to.covariance);
  return chol.matrixL().solve(Matrix6d::Identity());
}

// A new object whose ownership passes to Ceres with the pointer.
template <class T, class... Arguments>
T* owned_by_ceres(Arguments&&... arguments) {
  return std::make_unique<T>(std::forward<Arguments>(arguments)...).release();
}

template <int kResiduals, class Factor>
ceres::CostFunction* cost_of(const Factor& factor) {
  using Cost = ceres::AutoDiffCostFunction<Factor, kResiduals, kPoseParameters, kPoseParameters>;
  return owned_by_ceres<Cost>(owned_by_ceres<Factor>(factor));
}

void add_factor(const RelativePoseEdge& edge, const Matrix6d& L, const GraphConfig& config,
                Nodes& nodes, ceres::Problem& problem) {
  const bool paper = config.cost == GraphCost::kPaper;
  ceres::CostFunction* cost = paper ? cost_of<12>(FrobeniusFactor{edge.T_from_to.pose})
                                    : cost_of<6>(LieFactor{edge.T_from_to.pose, L});
  const double scale = paper ? kFrobeniusSigma * config.kernel_scale : config.kernel_scale;
  problem.AddResidualBlock(cost, owned_by_ceres<ceres::CauchyLoss>(scale),
                           nodes.at(edge.from).data(), nodes.at(edge.to).data());
}

// A graph over `nodes`, with the pose of self constant.
std::unique_ptr<ceres::Problem> build(const GraphProblem& input, const GraphConfig& config,
                                      Nodes& nodes) {
  auto problem = std::make_unique<ceres::Problem>();
  for (auto& [robot, x] : nodes) {
    problem->AddParameterBlock(x.data(), kPoseParameters, owned_by_ceres<PoseManifold>());
  }
  problem->SetParameterBlockConstant(nodes.at(input.self).data());
  for (const RelativePoseEdge& edge : input.edges) {
    if (!nodes.contains(edge.from) || !nodes.contains(edge.to)) continue;
    add_factor(edge, weight(edge, input.edges), config, nodes, *problem);
  }
  return problem;
}

}  // namespace

GraphSolution solve_pose_graph(const GraphProblem& input, const GraphConfig& config) {
  GraphProblem problem = input;
  std::erase_if(problem.edges, [](const RelativePoseEdge& edge) { return !is_usable(edge); });
  GraphSolution solution{.stamp = problem.stamp, .poses = {}};
  const auto chains = spanning_tree_poses(problem.self, problem.edges);
  Nodes nodes;
  for (const auto& [robot, chain] : chains) nodes.emplace(robot, to_parameters(chain.pose));
  if (nodes.size() < 2) return solution;

  ceres::Solver::Options options;
  options.max_num_iterations = config.max_iterations;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.max_solver_time_in_seconds = 1e9;  // bounded by iterations: a clock would not replay
  ceres::Solver::Summary summary;
  ceres::Solve(options, build(problem, config, nodes).get(), &summary);
  if (!summary.IsSolutionUsable()) return solution;

  std::map<RobotId, Pose> poses;
  for (const auto& [robot, x] : nodes) poses.emplace(robot, to_pose(x));
  const auto velocities = team_velocities(problem.self, poses, problem.edges);

  for (const auto& [robot, pose] : poses) {
    if (robot == problem.self) continue;
    const Matrix6d& covariance = chains.at(robot).covariance;
    solution.poses.push_back({robot, {pose, covariance}, velocities.at(robot)});
  }
  solution.cost = summary.final_cost;
  return solution;
}

}  // namespace crepes
