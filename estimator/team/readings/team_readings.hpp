/// The bearings and ranges of an interval, collected by camera and pair.
#pragma once

#include <optional>
#include <vector>

#include "estimator/team/belief/team_belief.hpp"
#include "estimator/team/belief/team_interval.hpp"
#include "estimator/team/readings/reading_scene.hpp"

namespace crepes {

/// All bearings of one camera to one robot.
struct Sight {
  RobotId observer{};
  RobotId neighbor{};
  std::size_t camera = 0;  ///< of the observer's
  std::vector<const Bearing*> bearings{};

  /// Of their mean, after the beginning of the interval.
  [[nodiscard]] double time_s(const TeamInterval& interval) const;
  [[nodiscard]] double sigma_rad() const;
};

/// All ranges that one robot measured to another.
struct Ranging {
  RobotId observer{};
  RobotId neighbor{};
  std::optional<RobotId> dark{};  ///< the one of them that nobody sees
  std::vector<const TeamRange*> ranges{};

  /// Of their mean.
  [[nodiscard]] double sigma_m() const;
};

/// Refers to an interval, which must outlive it.
struct TeamReadings {
  /// Between trusted robots; or between a trusted robot and one on probation. Nothing is learned
  /// from two robots on probation.
  enum class Stage { kTrusted, kProbation };

  std::vector<Sight> sights;
  std::vector<Ranging> rangings;

  /// The readings of an interval that this stage accepts.
  [[nodiscard]] static TeamReadings of(const TeamInterval& interval, const TeamBelief& belief,
                                       Stage stage);
  [[nodiscard]] bool empty() const { return sights.empty() && rangings.empty(); }
  /// The mean of their times, after the beginning of the interval.
  [[nodiscard]] double time_s(const TeamInterval& interval) const;
};

/// Between any two robots of the belief, those of refused cameras too.
[[nodiscard]] std::vector<Sight> all_sights(const TeamInterval& interval, const TeamBelief& belief);

/// Drops readings that are too unlikely. Counts how each camera and pair agrees, and when a robot
/// was last seen, in `belief`, which is that of the scene. Appends what was found to `residuals`.
void gate(const ReadingScene& scene, TeamBelief& belief, TeamReadings& readings,
          std::vector<TeamResidual>& residuals);

}  // namespace crepes
