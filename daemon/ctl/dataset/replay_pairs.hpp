/// The pairs of robots of which a replay has results, and the files of each.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The names of a pair, as in its file names.
struct PairName {
  std::string observer;
  std::string neighbor;
};

/// Every DIR/<observer>/<neighbor>.csv, in order. The truth/ of a data set looks alike.
[[nodiscard]] std::vector<PairName> pairs_in(const std::filesystem::path& results);

/// The error for a directory without pairs.
[[nodiscard]] Error no_pairs_in(const std::filesystem::path& results);

/// The rows of one pair. The last two are empty without --debug-innovations.
struct PairFiles {
  std::vector<NeighborPose> poses;
  std::vector<MeasurementRecord> measurements;
  std::vector<CalibrationRecord> calibrations;
};

/// A bad row in any of the files is an error.
[[nodiscard]] Result<PairFiles> read_pair(const std::filesystem::path& results,
                                          const PairName& pair);

}  // namespace crepes
