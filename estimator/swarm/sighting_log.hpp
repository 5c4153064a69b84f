/// Recent readings of one pair of robots, to be joined into mutual sightings (paper III-C).
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/swarm/event_sequencer.hpp"
#include "estimator/swarm/recent.hpp"
#include "estimator/swarm/robot_state.hpp"

namespace crepes {

/// Keeps the last half second, in order of arrival.
class SightingLog {
 public:
  /// `self` and `neighbor` give the mountings. `calibration_sigma_rad` and `range_bias_sigma_m` are
  /// what a single sighting cannot average out.
  SightingLog(MemberConfig self, MemberConfig neighbor, double calibration_sigma_rad,
              double range_sigma_m);

  void set_sigmas(double calibration_sigma_rad, double range_sigma_m) {
    calibration_sigma_rad_ = calibration_sigma_rad;
    range_sigma_m_ = range_sigma_m;
  }

  void add_own(const Bearing& bearing);
  void add_peer(const Bearing& bearing);
  void add_range(Timestamp stamp, double range_m);

  /// What could be started from at the instant when the neighbor saw us, one for each place where
  /// we saw it then; or what is missing. A bearing counts that another of the last moments agrees
  /// with: what flickers here and there is no robot.
  [[nodiscard]] std::variant<std::vector<MutualStart>, NoPoseReason> starts(
      const Bearing& peer_bearing, const RobotState& self, const RobotState& neighbor) const;

  /// What could be started from at our newest bearing, while the neighbor does not see us.
  [[nodiscard]] std::optional<Measurement> one_way_start(const RobotState& self,
                                                         const RobotState& neighbor) const;

 private:
  [[nodiscard]] Sighting sighting(const Bearing& bearing, const Tilt& tilt,
                                  const MemberConfig& member) const;
  [[nodiscard]] std::vector<Bearing> own_at(Timestamp t, const ImuHistory& imu) const;
  [[nodiscard]] std::optional<double> range_at(Timestamp t) const;

  struct StampedRange {
    Timestamp stamp{};
    double range_m = 0.0;
  };
  MemberConfig self_;
  MemberConfig neighbor_;
  double calibration_sigma_rad_;
  double range_sigma_m_;
  Recent<Bearing, 256> own_;
  Recent<Bearing, 256> peer_;
  Recent<StampedRange, 256> ranges_;
};

}  // namespace crepes
