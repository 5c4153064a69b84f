/// crepesctl evaluate: compares the poses of a replay with ground truth.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

/// Options of `crepesctl evaluate`.
struct EvaluateOptions {
  std::filesystem::path results;  ///< the output folder of replay
  std::filesystem::path swarm;    ///< the data set
  std::filesystem::path
      against;           ///< other results of the same data set for comparison; may be empty
  double after_s = 5.0;  ///< the first seconds are not scored
  bool json = false;
  std::function<void(double)> on_progress;  ///< receives the progress, 0..1; may be empty
};

/// A table, or a JSON document.
[[nodiscard]] Result<std::string> evaluate(const EvaluateOptions& options);

}  // namespace crepes
