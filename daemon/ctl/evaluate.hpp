/// crepesctl evaluate: poses of a replay against ground truth.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

struct EvaluateOptions {
  std::filesystem::path results;  ///< what replay wrote
  std::filesystem::path swarm;    ///< the data set
  std::filesystem::path
      against;           ///< other results of the same data set to compare with; may be empty
  double after_s = 5.0;  ///< the first seconds are not scored
  bool json = false;
  std::function<void(double)> on_progress;  ///< is told the share that is done; may be empty
};

/// A table, or a JSON document.
[[nodiscard]] Result<std::string> evaluate(const EvaluateOptions& options);

}  // namespace crepes
