/// Starts the tracks of one neighbor.
#pragma once

#include <span>

#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/hypothesis_set.hpp"
#include "estimator/swarm/observation_buffer.hpp"
#include "estimator/swarm/reading_intake.hpp"

namespace crepes {

/// Computes first poses: from mutual sightings, or after two seconds in which only one of the two
/// robots has seen the other, from bearings of that one. They pass through the reorder buffer as
/// measurements and then start hypotheses.
class TrackInitiator {
 public:
  TrackInitiator(const MemberConfig& self, const MemberConfig& neighbor,
                 const FilterSettings& settings);

  /// Applies to the next readings.
  void reconfigure(const FilterSettings& settings);

  /// A bearing of our cameras.
  void add_bearing(const Bearing& bearing) { observations_.add_own_bearing(bearing); }
  /// A range of either module.
  void add_range(Timestamp stamp, double range_m) { observations_.add_range(stamp, range_m); }
  /// Queues the raw poses that the bearing completes, if `hypotheses` need one. If a reading of
  /// ours is missing, it may come later than the bearing: the next ticks try again.
  void add_peer_bearing(const Bearing& bearing, const RobotState& self, const RobotState& neighbor,
                        const HypothesisSet& hypotheses, ReadingIntake& intake);
  /// Queues the neighbor's estimate of us, if only the neighbor sees us, it knows how we are
  /// turned, and we do not.
  void add_peer_estimate(const NeighborEstimate& estimate, const HypothesisSet& hypotheses,
                         ReadingIntake& intake) const;
  /// Queues raw poses of bearings that have waited for the reorder buffer's lag, and a one-way
  /// initialization, if only one of the two sees the other. Call once a tick.
  void tick(Timestamp now, const RobotState& self, const RobotState& neighbor,
            const HypothesisSet& hypotheses, ReadingIntake& intake);

  /// True if the measurement starts a hypothesis instead of correcting one.
  [[nodiscard]] bool is_initialization(const Measurement& measurement,
                                       const HypothesisSet& hypotheses) const;
  /// Starts hypotheses from a group of such measurements.
  static void initialize(std::span<const Measurement> group, const ImuHistory& imu_B,
                         const ImuHistory& imu_N, HypothesisSet& hypotheses, OutcomeLog& outcomes);

  /// Why the latest mutual sighting gave no raw pose; kNone if it did.
  [[nodiscard]] NoPoseReason raw_pose_reason() const { return raw_pose_reason_; }

 private:
  [[nodiscard]] bool needs_raw_pose(const Bearing& bearing, const RobotState& self,
                                    const RobotState& neighbor,
                                    const HypothesisSet& hypotheses) const;
  void enqueue_raw_poses(Timestamp stamp, const MutualInitializations& result,
                         ReadingIntake& intake);
  void join_waiting(Timestamp due, const RobotState& self, const RobotState& neighbor,
                    const HypothesisSet& hypotheses, ReadingIntake& intake);

  ProfileTraits traits_;
  ObservationBuffer observations_;
  BoundedFifo<Bearing, 256> waiting_;  ///< of the neighbor; readings of ours are missing
  Timestamp one_way_since_ = kNever;
  std::optional<FilterAxes> one_way_;  ///< of the robot that sees, if only one has for a while
  NoPoseReason raw_pose_reason_ = NoPoseReason::kNotSeen;
};

}  // namespace crepes
