#include "estimator/swarm/team_log.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace crepes {

void TeamLog::add(const TeamSolution& solution) {
  constexpr double kMemory = 5.0;  // s
  const double dt = stamp_ ? to_seconds(solution.stamp - *stamp_) : 0.0;
  const double kept = std::exp(-std::max(0.0, dt) / kMemory);
  for (auto& [robot, sums] : sums_) {
    for (Sum& sum : sums) {
      sum.nis *= kept;
      sum.dimension *= kept;
    }
  }
  for (const TeamResidual& residual : solution.residuals) {
    Sum& sum = sums_[residual.observer].at(static_cast<std::size_t>(residual.kind));
    sum.fused += static_cast<std::uint64_t>(residual.fused);
    sum.refused += static_cast<std::uint64_t>(residual.refused);
    if (residual.fused == 0) continue;
    sum.nis += residual.nis;
    sum.dimension += residual.dimension;
  }
  stamp_ = solution.stamp;
  calibrations_ = solution.calibrations;
  faults_ = solution.faults;
}

void TeamLog::expire(Timestamp now) {
  constexpr Duration kLife = std::chrono::seconds{2};
  if (stamp_ && now - *stamp_ > kLife) faults_.clear();
}

std::vector<TeamFault> TeamLog::faults_of(RobotId robot) const {
  std::vector<TeamFault> of_robot;
  std::ranges::copy_if(faults_, std::back_inserter(of_robot),
                       [robot](const TeamFault& fault) { return fault.robot == robot; });
  return of_robot;
}

std::optional<TeamStatus> TeamLog::status() const {
  constexpr double kLeast = 1.0;  // dimensions; fewer have faded
  if (!stamp_) return std::nullopt;
  TeamStatus status{.stamp = *stamp_, .robots = {}};
  for (const RobotCalibration& calibration : calibrations_) {
    TeamRobotStatus robot{
        .calibration = calibration, .residuals = {}, .faults = faults_of(calibration.robot)};
    if (const auto sums = sums_.find(calibration.robot); sums != sums_.end()) {
      for (std::size_t kind = 0; kind < kTeamResidualKindCount; ++kind) {
        const Sum& sum = sums->second.at(kind);
        ResidualStatus& residual = robot.residuals.at(kind);
        residual = {.nis = {}, .fused = sum.fused, .refused = sum.refused};
        if (sum.dimension >= kLeast) residual.nis = sum.nis / sum.dimension;
      }
    }
    status.robots.push_back(std::move(robot));
  }
  return status;
}

}  // namespace crepes
