/// The files that `replay --debug-innovations` writes for the team's filter of each observer: how
/// the measurements of each interval agree, and the estimated calibrations of all robots.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The stem of the files' names, in the observer's folder.
inline constexpr std::string_view kTeamStem = "team";

using RobotNames = std::map<RobotId, std::string>;

/// A row of team.innovations.csv. The robots of `residual` are named only.
struct TeamInnovationRow {
  Timestamp stamp{};
  std::string observer;
  std::string neighbor;
  TeamResidual residual;
};

/// t_ns,robot,neighbor,kind,camera,fused,refused,nis,dof,r0,s0,r1,s1: components beyond `dof` and
/// those of the gyroscope are empty.
[[nodiscard]] std::string team_innovation_file_header();
void append_team_innovation_rows(std::string& text, const TeamRecord& record,
                                 const RobotNames& names);
/// Any bad row is an error.
[[nodiscard]] Result<std::vector<TeamInnovationRow>> read_team_innovation_file(
    const std::filesystem::path& file);

/// A row of team.calibration.csv: one quantity of one robot. A scalar has one component.
struct TeamCalibrationRow {
  Timestamp stamp{};
  std::string robot;
  std::string quantity;
  int dimension = 0;
  std::array<double, 3> value{};
  std::array<double, 3> sigma{};
};

/// t_ns,robot,quantity,x,sigma_x,y,sigma_y,z,sigma_z
[[nodiscard]] std::string team_calibration_file_header();
void append_team_calibration_rows(std::string& text, const TeamRecord& record,
                                  const RobotNames& names);
[[nodiscard]] Result<std::vector<TeamCalibrationRow>> read_team_calibration_file(
    const std::filesystem::path& file);

}  // namespace crepes
