/// tape.yaml: distances that somebody measured while the robots were at rest.
#pragma once

#include <filesystem>
#include <map>
#include <string>
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
  RobotId turning{};  ///< turned slowly about its antenna meanwhile; 0: nobody
};

/// "r1,r2=5.00": names or ids of two robots that rested all the time. `names` are those of the
/// swarm.
[[nodiscard]] Result<TapedPair> parse_distance(const std::string& text,
                                               const std::map<std::string, RobotId>& names);

/// An error names file, line and key.
[[nodiscard]] Result<std::vector<TapeSegment>> load_tape(const std::filesystem::path& file);

}  // namespace crepes
