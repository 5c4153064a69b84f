/// Recent bearings and ranges of one pair of robots, joined into mutual sightings (paper III-C).
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "estimator/core/bounded_fifo.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/swarm_config.hpp"
#include "estimator/swarm/measurement.hpp"
#include "estimator/swarm/robot_state.hpp"

namespace crepes {

/// Poses at the stamp of a mutual sighting, or why there is none.
using MutualInitializations = std::variant<std::vector<MutualInitialization>, NoPoseReason>;

/// Keeps the last half second, in order of arrival.
class ObservationBuffer {
 public:
  /// `self` and `neighbor` contain the mountings. `calibration_sigma_rad` is added to the noise of
  /// each bearing. `range_sigma_m` is one sigma of a single range, with its bias.
  ObservationBuffer(MemberConfig self, MemberConfig neighbor, double calibration_sigma_rad,
                    double range_sigma_m);

  /// Sets the noise of bearings' calibration and of ranges.
  void set_sigmas(double calibration_sigma_rad, double range_sigma_m) {
    calibration_sigma_rad_ = calibration_sigma_rad;
    range_sigma_m_ = range_sigma_m;
  }

  /// A bearing of our cameras.
  void add_own_bearing(const Bearing& bearing);
  /// A bearing of the neighbor's cameras.
  void add_peer_bearing(const Bearing& bearing);
  /// A range of either module.
  void add_range(Timestamp stamp, double range_m);

  /// Raw poses at the stamp of `peer_bearing`, one for each own bearing near that instant; or why
  /// there is none. Where there is no range, the size of the ring gives the distance, if it may. A
  /// bearing counts only if another one within 0.1 s has about its direction: a single flicker is
  /// not a robot. If the peer sent none within 0.1 s, one within 0.3 s counts.
  [[nodiscard]] MutualInitializations mutual_initializations(const Bearing& peer_bearing,
                                                             const RobotState& self,
                                                             const RobotState& neighbor) const;

  /// Poses at the stamp of the newest bearing with a range, in the axes of the robot that sees the
  /// other one.
  [[nodiscard]] std::optional<Measurement> one_way_initialization(FilterAxes axes,
                                                                  const RobotState& self,
                                                                  const RobotState& neighbor) const;

 private:
  void add_sighting(Timestamp stamp);
  [[nodiscard]] Sighting sighting(const Bearing& bearing, const Tilt& tilt,
                                  const MemberConfig& member) const;
  [[nodiscard]] std::vector<Bearing> own_at(Timestamp t, const ImuHistory& imu) const;
  [[nodiscard]] std::optional<RangeReading> range_at(Timestamp t) const;
  static std::optional<RangeReading> range_by_ring(const Bearing& bearing, const MemberConfig& seer,
                                                   const MemberConfig& seen);

  struct StampedRange {
    Timestamp stamp{};
    double range_m = 0.0;
  };
  MemberConfig self_;
  MemberConfig neighbor_;
  double calibration_sigma_rad_;
  double range_sigma_m_;
  BoundedFifo<Bearing, 256> own_;
  BoundedFifo<Bearing, 256> peer_;
  BoundedFifo<StampedRange, 256> ranges_;
  std::optional<Timestamp> sighted_;  ///< when either robot last saw the other
};

}  // namespace crepes
