/// The charts of one observer's team filter: residuals and calibrations of all robots.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "drivers/dataset/team_record_file.hpp"

namespace crepes {

/// The team as one observer estimated it.
struct TeamData {
  std::string observer;
  std::vector<TeamInnovationRow> innovations;
  std::vector<TeamCalibrationRow> calibrations;
  std::function<double(Timestamp)> seconds;  ///< since the recording began
  double duration_s = 0.0;
};

/// The records in the observer's folder; none if the replay wrote none. A bad row is an error.
[[nodiscard]] Result<TeamData> read_team(const std::filesystem::path& results,
                                         const std::string& observer);

/// Groups of charts as HTML, each under a heading. Empty without records.
[[nodiscard]] std::string team_charts(const TeamData& team);

}  // namespace crepes
