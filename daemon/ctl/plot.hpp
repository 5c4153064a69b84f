/// crepesctl plot: a replay as one page to look at.
#pragma once

#include <filesystem>

#include "estimator/core/result.hpp"

namespace crepes {

struct PlotOptions {
  std::filesystem::path results;  ///< what replay wrote
  std::filesystem::path swarm;    ///< the data set, for errors against its truth; may be empty
  std::filesystem::path out;      ///< the page; empty: plot.html in `results`
};

/// Writes one HTML page that needs nothing else: for every ordered pair errors with 3-sigma bands
/// (without truth the sigmas), modes over time, age of the outputs; where replay wrote records
/// (--debug-innovations) also the innovations of each kind and the estimated biases. Returns where
/// the page is. A missing or faulty file is an error that names it; records alone may be missing.
[[nodiscard]] Result<std::filesystem::path> plot(const PlotOptions& options);

}  // namespace crepes
