/// The charts of one ordered pair.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/ctl/score/pair_score.hpp"
#include "estimator/core/outputs.hpp"

namespace crepes {

/// The results of one pair.
struct PairData {
  std::string observer;
  std::string neighbor;
  std::vector<NeighborPose> poses;
  std::vector<MeasurementRecord> measurements;  ///< empty if replay wrote none
  std::vector<CalibrationRecord> calibrations;
  RelativeTruth truth;                       ///< T_B_N; empty without truth
  RelativeTruth observer_truth;              ///< T_W_B; empty without truth
  std::function<double(Timestamp)> seconds;  ///< since the recording began
  double duration_s = 0.0;
};

/// The cells of the summary's row, as in `summary_header`.
[[nodiscard]] std::vector<std::string> summary_header();
[[nodiscard]] std::vector<std::string> summary_row(const PairData& pair);

/// Groups of charts as HTML, each under a heading.
[[nodiscard]] std::string pair_charts(const PairData& pair);

}  // namespace crepes
