/// crepesctl plot: the results of a replay as one HTML page.
#pragma once

#include <filesystem>

#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl plot`.
struct PlotOptions {
  std::filesystem::path results;  ///< the output folder of replay
  std::filesystem::path swarm;    ///< the data set, for errors against its truth; may be empty
  std::filesystem::path out;      ///< the page; empty: plot.html in `results`
  bool force = false;             ///< replace a file that is no page
};

/// Writes one HTML page that needs no other file. For every ordered pair it shows errors with
/// 3-sigma bands (without truth the sigmas), modes over time, and the age of the outputs. If replay
/// wrote records (--debug-innovations), it also shows the innovations of each kind and the
/// estimated biases, and for every observer the residuals and calibrations of its team. Returns the
/// page's path. A missing or faulty file is an error that names it; only records may be missing.
[[nodiscard]] Result<std::filesystem::path> plot(const PlotOptions& options);

}  // namespace crepes
