/// What this robot broadcasts.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "estimator/core/bounded_fifo.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/swarm/robot_state.hpp"

namespace crepes {

/// Every report has the measurements of the last 520 ms; the mesh decides how often each is
/// repeated. Bearings are thinned to one a neighbor and report; the filter at the other end gains
/// nothing from a camera's every frame.
class ReportComposer {
 public:
  explicit ReportComposer(RobotId self) : self_(self) {}

  /// A bearing for the next report.
  void add(const Bearing& bearing) { newest_[bearing.neighbor].push_back(bearing); }
  /// A range for the next report.
  void add(const UwbRange& range) { ranges_.add(range); }

  /// Empty before there is a tilt: peers could do nothing with the rest.
  [[nodiscard]] std::optional<Report> compose(Timestamp now, const RobotState& self,
                                              const std::vector<NeighborEstimate>& estimates);

 private:
  RobotId self_;
  std::map<RobotId, std::vector<Bearing>> newest_;  ///< since the last report
  BoundedFifo<Bearing, 1024> bearings_;
  BoundedFifo<UwbRange, 1024> ranges_;
};

}  // namespace crepes
