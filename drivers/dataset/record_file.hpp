/// The files that `replay --debug-innovations` writes for each pair: the verdict of every
/// measurement, and the estimated calibration.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// t_ns,kind,verdict,nis,dof,r0,s0,...,r8,s8,z0,...,z5: residual and its sigma (root of S_ii) by
/// component; the components beyond `dof` are empty, and those of `SensorReading` that the kind has
/// not.
[[nodiscard]] std::string innovation_file_header();
void append_innovation_row(std::string& text, const MeasurementRecord& record);
/// Any bad row is an error.
[[nodiscard]] Result<std::vector<MeasurementRecord>> read_innovation_file(
    const std::filesystem::path& file);

/// t_ns, then each of CalibrationRecord::kNames, then each of them with `_sigma`.
[[nodiscard]] std::string calibration_file_header();
void append_calibration_row(std::string& text, const CalibrationRecord& record);
[[nodiscard]] Result<std::vector<CalibrationRecord>> read_calibration_file(
    const std::filesystem::path& file);

}  // namespace crepes
