/// tape.yaml: distances that somebody measured while the robots were at rest.
#pragma once

#include <filesystem>
#include <vector>

#include "estimator/calibration/range/range_calibration.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Two robots and the distance between them.
struct TapedPair {
  RobotPair pair;
  double distance_m = 0.0;  ///< antenna to antenna
};
/// A part of a recording in which a distance is constant.
struct TapeSegment {
  double from_s = 0.0;  ///< after the recording's first row
  double to_s = 0.0;
  std::vector<TapedPair> pairs;
};

/// An error names file, line and key.
[[nodiscard]] Result<std::vector<TapeSegment>> load_tape(const std::filesystem::path& file);

}  // namespace crepes
