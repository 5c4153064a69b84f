/// Recent readings of one pair of robots, to be joined into mutual sightings (paper III-C).
#pragma once

#include <optional>
#include <variant>

#include "estimator/core/config.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/relative/raw_pose.hpp"
#include "estimator/swarm/recent.hpp"
#include "estimator/swarm/robot_state.hpp"

namespace crepes {

/// Keeps the last half second, in order of arrival.
class SightingLog {
 public:
  /// `self` and `neighbor` give the mountings. `calibration_sigma_rad` and `range_bias_sigma_m` are
  /// what a single sighting cannot average out.
  SightingLog(const MemberConfig& self, const MemberConfig& neighbor, double calibration_sigma_rad,
              double range_sigma_m);

  void add_own(const Bearing& bearing);
  void add_range(Timestamp stamp, double range_m);

  /// The raw pose at the instant when the neighbor saw us; or what is missing.
  [[nodiscard]] std::variant<RawPose, NoPoseReason> raw_pose(const Bearing& peer_bearing,
                                                             const RobotState& self,
                                                             const RobotState& neighbor) const;

 private:
  [[nodiscard]] std::optional<Bearing> own_at(Timestamp t, const ImuHistory& imu) const;
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
  Recent<StampedRange, 256> ranges_;
};

}  // namespace crepes
