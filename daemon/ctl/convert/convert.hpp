/// crepesctl convert: a recording or a replay as a file of another tool.
#pragma once

#include <filesystem>
#include <functional>

#include "drivers/dataset/dataset_faults.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl convert`.
struct ConvertOptions {
  std::filesystem::path source;  ///< a recorded swarm, or the output directory of replay
  std::filesystem::path swarm;   ///< of a replay: its data set, with clocks and truth; may be empty
  std::filesystem::path out;     ///< the file
  bool force = false;            ///< replace a file that is no MCAP file
  std::function<void(double)> on_progress;  ///< progress, 0..1, called regularly
};

/// What was written.
struct ConvertSummary {
  std::size_t topics = 0;
  std::uint64_t messages = 0;
  std::uint64_t before_start = 0;  ///< left out: their time is negative
  DatasetFaults faults;            ///< rows of a recording that were refused
};

/// Writes an MCAP file for Foxglove and similar tools, in order of time. Its times are those of the
/// recording from 0 on.
[[nodiscard]] Result<ConvertSummary> convert_to_mcap(const ConvertOptions& options);

}  // namespace crepes
