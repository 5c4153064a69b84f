/// A replay on disk, as the page reads it.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/dataset/replay_pairs.hpp"
#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "daemon/ctl/dataset/truth.hpp"

namespace crepes {

/// Files are read when a page asks for them: a replay may be longer than the memory.
class RecordedFeed {
 public:
  /// `swarm` is the data set with the truth, or empty.
  [[nodiscard]] static Result<RecordedFeed> open(const std::filesystem::path& results,
                                                 const std::filesystem::path& swarm);

  /// The names of the observers, in order.
  [[nodiscard]] const std::vector<std::string>& observers() const { return observers_; }

  /// All that this observer saw, as one JSON object: `has_truth`, `up` (rows of t, x, y, z of the
  /// vector against gravity in its body; from the truth, empty without it), `cameras` (see
  /// `field_of_view_json`), `mounting` (`led`, `uwb` in its body), both from the data set's
  /// configuration, and `neighbors` with `name`, `mounting`, `rows` (see `pose_row`), `truth` (see
  /// `truth_row`), and after `replay --debug-innovations` `innovations` (t, kind, verdict, NIS by
  /// degree of freedom or null, then what was measured, see `SensorReading`), `gated` (t,
  /// measurements a second) and `calibrations` (t, then the values of CalibrationRecord). Times are
  /// true time if there is truth, otherwise seconds since the observer's first row. At most 25 rows
  /// a second.
  [[nodiscard]] Result<std::string> json_of(const std::string& observer) const;

 private:
  struct Recording {
    SwarmManifest manifest;
    SwarmTruth truth;
    std::map<std::string, Config> configs;  ///< of each robot
  };

  [[nodiscard]] const SwarmRobot* robot_named(const std::string& name) const;

  std::filesystem::path results_;
  std::vector<PairName> pairs_;
  std::vector<std::string> observers_;
  std::optional<Recording> recording_;
};

}  // namespace crepes
