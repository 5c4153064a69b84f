/// What the team's filter found of each robot's sensors: the latest calibrations, recent residuals.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "estimator/core/outputs.hpp"

namespace crepes {

/// Follows the solutions of the team's filter.
class TeamLog {
 public:
  /// In the order of their stamps.
  void add(const TeamSolution& solution);
  void clear() { *this = TeamLog(); }
  /// Forgets faults that no later solution has confirmed: a team that is none any more has none.
  void expire(Timestamp now);

  /// By the latest solution.
  [[nodiscard]] std::vector<TeamFault> faults_of(RobotId robot) const;
  /// The robots of the latest solution, ordered by id. Empty before the first.
  [[nodiscard]] std::optional<TeamStatus> status() const;

 private:
  /// Sums over about the last seconds, and counts since the beginning.
  struct Sum {
    double nis = 0.0;
    double dimension = 0.0;
    std::uint64_t fused = 0;
    std::uint64_t refused = 0;
  };
  using Sums = std::array<Sum, kTeamResidualKindCount>;

  std::optional<Timestamp> stamp_;  ///< of the latest solution
  std::vector<RobotCalibration> calibrations_;
  std::vector<TeamFault> faults_;
  std::map<RobotId, Sums> sums_;
};

}  // namespace crepes
