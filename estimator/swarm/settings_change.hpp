/// What a running estimator must forget when its settings change.
#pragma once

#include <set>

#include "estimator/core/measurements.hpp"
#include "estimator/swarm/estimator_settings.hpp"

namespace crepes {

/// What begins anew. Everything else keeps its state.
struct SettingsChange {
  bool restarts_tracks = false;          ///< of lights: their IDs are decoded again
  bool restarts_team = false;            ///< what the team has learned of the robots' sensors
  std::set<RobotId> restarts_neighbors;  ///< filters, also of those that are no members any more
};

/// Names of robots change nothing.
[[nodiscard]] SettingsChange change_between(const EstimatorSettings& before,
                                            const EstimatorSettings& now);

}  // namespace crepes
