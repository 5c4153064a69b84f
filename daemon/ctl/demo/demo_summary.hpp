/// The result of a demo: every ordered pair against the simulated truth.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/demo/formation_score.hpp"
#include "daemon/ctl/score/pair_score.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

struct DemoSummary {
  /// The poses of one robot by another, scored.
  struct Pair {
    RobotId observer{};
    RobotId neighbor{};
    std::optional<Duration> first_pose;  ///< after the daemons' start
    PairScore score;
  };
  SimScenario scenario{};
  int seed = 0;
  double from_s = 0.0;  ///< world time of what is scored
  double to_s = 0.0;
  std::vector<Pair> pairs;
  std::optional<FormationScore> formation{};  ///< of robots that were steered
};

/// The name of a robot of the demo: r1, r2, ...
[[nodiscard]] std::string name_of_robot(RobotId id);

[[nodiscard]] std::string demo_text(const DemoSummary& summary);
[[nodiscard]] std::string demo_json(const DemoSummary& summary);

/// Returns an error that names the pairs without a pose, if there are any.
[[nodiscard]] Result<void> check_poses(const DemoSummary& summary);

}  // namespace crepes
