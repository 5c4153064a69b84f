/// Where the neighbors were within the last second. Pure.
#pragma once

#include <deque>
#include <map>
#include <optional>

#include "estimator/core/outputs.hpp"

namespace crepes {

/// Pictures come later than poses of the same instant.
class PoseHistory {
 public:
  /// Stamps that go back begin a new history: the daemon has started anew.
  void add(const NeighborPose& pose);

  /// T_B_N at `t`, between the poses before and after it. Empty if there is none within 0.1 s.
  [[nodiscard]] std::optional<Pose> at(RobotId neighbor, Timestamp t) const;

 private:
  struct Entry {
    Timestamp stamp{};
    Pose T_B_N;
  };
  std::map<RobotId, std::deque<Entry>> entries_;
};

}  // namespace crepes
