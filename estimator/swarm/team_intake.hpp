/// Collects what everybody measured for the team's filter.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "estimator/core/swarm_config.hpp"
#include "estimator/swarm/adaptive_lag.hpp"
#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/range_screen.hpp"
#include "estimator/team/belief/team_interval.hpp"

namespace crepes {

/// All bearings and ranges of this robot's reports and its peers', by the time at which they were
/// measured. Refuses ranges without line of sight.
class TeamIntake {
 public:
  /// The IMU of a robot, own or as it reports it; null where there is none.
  using ImuOf = std::function<const ImuHistory*(RobotId)>;

  /// A peer's report, whose measurements are new; `turn_sigma_rad` is added to its bearings' noise.
  /// Measurements of robots that are no members are ignored.
  void add_report(const Report& report, double turn_sigma_rad, const SwarmConfig& swarm,
                  const FilterSettings& settings);
  /// This robot's report, which repeats measurements. A source's measurements come in order; those
  /// of another may be later by a camera's delay.
  void add_own_report(const Report& report, const SwarmConfig& swarm,
                      const FilterSettings& settings);

  /// The interval since the last one until the lag before `now`. Measurements of it that arrive
  /// later are lost; the lag follows their delays. Empty while it grows as fast as the time.
  [[nodiscard]] std::optional<TeamInterval> drain(RobotId self, Timestamp now,
                                                  const SwarmConfig& swarm,
                                                  const FilterSettings& settings,
                                                  const ImuOf& imu_of);

 private:
  using CameraPlace = std::array<double, 3>;  ///< in the body: by it, reports name a camera

  void record_delay(Timestamp stamp);
  void add_range(RobotId observer, const UwbRange& range, const FilterSettings& settings);

  std::vector<TeamBearing> bearings_;
  std::vector<TeamRange> ranges_;
  std::map<std::pair<RobotId, RobotId>, RangeScreen> screens_;
  std::map<RobotId, Timestamp> newest_own_range_;  ///< by neighbor
  std::map<std::pair<RobotId, CameraPlace>, Timestamp> newest_own_bearing_;
  Timestamp last_ = kNever;
  AdaptiveLag lag_{Duration::zero()};
  Timestamp now_ = kNever;  ///< of the last interval
};

}  // namespace crepes
