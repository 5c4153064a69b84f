/// What every `crepesctl calibrate` returns.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "drivers/dataset/dataset_faults.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// `text` is for standard output: tables, or one JSON object. With reasons, the calibration is
/// refused and no file was written.
struct CalibrationReport {
  std::string text;
  std::vector<std::string> reasons;
  DatasetFaults faults;  ///< rows of the recording that were refused
};

/// Fills in `ok`, `reasons` and `warnings`, which every JSON object begins with.
[[nodiscard]] nlohmann::ordered_json report_head(const std::vector<std::string>& reasons,
                                                 const std::vector<std::string>& warnings);

/// The JSON object of a calibration that could not begin.
[[nodiscard]] std::string failed_report(const Error& error);

/// One line each.
[[nodiscard]] std::string warning_lines(const std::vector<std::string>& warnings);

/// Whether `crepesctl calibrate TOOL` may write these files: see `check_replaceable`.
[[nodiscard]] Result<void> check_results(const std::vector<std::filesystem::path>& files,
                                         const std::string& tool, bool force);

/// `file` with `suffix` in the place of its extension, as imu.yaml and imu.kalibr.yaml.
[[nodiscard]] std::filesystem::path beside(const std::filesystem::path& file,
                                           const std::string& suffix);

}  // namespace crepes
