/// The estimation of one neighbor.
#pragma once

#include "estimator/core/outputs.hpp"
#include "estimator/core/swarm_config.hpp"
#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/hypothesis_set.hpp"
#include "estimator/swarm/pose_publisher.hpp"
#include "estimator/swarm/reading_intake.hpp"
#include "estimator/swarm/robot_state.hpp"
#include "estimator/swarm/track_initiator.hpp"

namespace crepes {

/// A pose of the graph's solution and its time.
struct StampedGraphPose {
  Timestamp stamp;
  GraphPose pose;
};

/// Readings enter through the intake and wait in its reorder buffer until the lag has passed. Each
/// tick fuses the released ones or starts hypotheses from them. Poses do not wait: the publisher
/// predicts them from a copy of the filter.
class Neighbor {
 public:
  Neighbor(const MemberConfig& self, const MemberConfig& neighbor, const FilterSettings& settings);

  /// Keeps the state of the estimation, except for another profile.
  void reconfigure(const FilterSettings& settings);

  /// Where our camera sees it.
  void add(const Bearing& bearing);
  /// Our module's range to it.
  void add(const UwbRange& range);
  /// Its pose by the graph's solution. While anybody sees it, that corrects the published pose
  /// only.
  void add(const StampedGraphPose& solution);
  /// Its pose by the team's filter.
  void add(const TeamEstimate& estimate);
  /// Counts a range, ours or the neighbor's, that does not end where it says.
  void refuse(const UwbRange& range, MeasurementKind kind);
  /// A report of the neighbor; `self` is the state of our robot.
  void add_report(const ReceivedReport& received, const RobotState& self);

  /// Advances to `now`: fuses the released readings and updates the pose.
  void tick(Timestamp now, const RobotState& self);
  /// The team found its gyroscope false: no filter runs until then.
  void refuse_imu_until(Timestamp t) { body_.refused_until = t; }
  /// The team does not know it any more.
  void end_team_pose() { publisher_.end_team_pose(); }

  /// The pose at the last tick.
  [[nodiscard]] const PosePublisher& output() const { return publisher_; }
  [[nodiscard]] NeighborStatus status() const;
  [[nodiscard]] OutcomeLog& outcomes() { return intake_.outcomes(); }
  /// IMU and tilt, from its reports.
  [[nodiscard]] const RobotState& robot_state() const { return body_; }

 private:
  void fuse_released(Timestamp now, const RobotState& self);
  [[nodiscard]] NoPoseReason reason(Timestamp now, const RobotState& self) const;

  RobotId id_;
  RobotId self_id_;
  PairMounting mounting_;
  Duration recent_;

  RobotState body_;
  ReadingIntake intake_;
  TrackInitiator initiator_;
  HypothesisSet hypotheses_;
  PosePublisher publisher_;
  NoPoseReason reason_ = NoPoseReason::kNeverHeard;
};

}  // namespace crepes
