/// Biases of UWB modules from ranges between robots at rest at known distances.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimator/calibration/range/turn_pattern.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

/// Two robots, the smaller id first.
struct RobotPair {
  RobotId a{};
  RobotId b{};
  auto operator<=>(const RobotPair&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// The ranges of a pair during one rest, whoever measured them, in time order.
struct TapedRanges {
  RobotPair pair;
  std::size_t segment = 0;  ///< counted from 0, in the order of the tape
  double distance_m = 0.0;  ///< by tape, antenna to antenna
  std::vector<UwbRange> ranges{};
  RobotId turning{};                   ///< turned slowly about its antenna meanwhile; 0: nobody
  std::vector<double> headings_rad{};  ///< then its heading at each range, from 0 on
};

/// `uwb.late_path_db` of the robots that measure. Who is missing has the default.
using LatePathLimits = std::map<RobotId, double>;

/// measured = distance + bias
struct SegmentBias {
  RobotPair pair;
  std::size_t segment = 0;
  double bias_m = 0.0;
  double scatter_m = 0.0;  ///< one sigma of a single range
  std::size_t used = 0;
  std::size_t late = 0;      ///< refused by their first path's power
  std::size_t outliers = 0;  ///< refused by the robust mean
};
/// The bias of the ranges between two robots.
struct PairBias {
  RobotPair pair;
  double bias_m = 0.0;
  double sigma_m = 0.0;
};
/// The delay of one module.
struct ModuleBias {
  RobotId id{};
  double bias_m = 0.0;
  double sigma_m = 0.0;
};

/// A module that turned before another one.
struct ModulePattern {
  RobotId id{};
  RobotPair pair;
  TurnPattern pattern;
};

struct RangeCalibration {
  std::vector<SegmentBias> segments;
  std::vector<ModulePattern> patterns;
  std::vector<PairBias> pairs;         ///< by pair
  std::vector<ModuleBias> modules;     ///< empty where the pairs do not determine them
  double noise_m = 0.0;                ///< of a single range, without outliers
  double direction_sigma_m = 0.0;      ///< by which a pair's bias differs from rest to rest
  std::optional<double> late_path_db;  ///< a threshold that refuses outliers; empty if none helps
  std::vector<std::string> refusals;
  std::vector<std::string> warnings;
};

/// A pair's bias is the sum of its modules' biases. Each rest of a pair is one measurement of it:
/// Tukey's biweight mean of the ranges that came by a direct path. Beside noise and tape it errs by
/// what the directions of arrival add, which differs between rests and is estimated from them
/// (a variance component). Modules by weighted least squares over all pairs; a pair then has the
/// sum of its modules.
///
/// A module that turned has its mean over all directions in that segment, and a pattern.
[[nodiscard]] RangeCalibration calibrate_ranges(std::span<const TapedRanges> taped,
                                                const LatePathLimits& late_path_db);

}  // namespace crepes
