/// The published pose of one neighbor.
#pragma once

#include <optional>

#include "estimator/core/bounded_fifo.hpp"
#include "estimator/swarm/output_predictor.hpp"
#include "estimator/swarm/reading_intake.hpp"
#include "estimator/swarm/robot_state.hpp"

namespace crepes {

/// A neighbor's pose by the team's filter, with what that knows of both IMUs.
struct TeamEstimate {
  Timestamp stamp;
  TeamPose pose;
  ImuBiasEstimate bias_B;
  ImuBiasEstimate bias_N;
};

/// Predicts the leading filter to the newest own IMU sample at each tick. The graph's solution
/// corrects the published pose only: it contains this filter's own estimate, and fusing it would
/// count the same readings twice.
class PosePublisher {
 public:
  PosePublisher(RobotId neighbor, PairMounting mounting, const FilterSettings& settings);

  /// Applies to the next predictions.
  void reconfigure(const FilterSettings& settings);

  /// A reading or sample has arrived for `stamp`.
  void invalidate_from(Timestamp stamp) { predictor_.invalidate_from(stamp); }
  void clear() {
    pose_.reset();
    team_pose_.reset();
  }
  /// Requires samples of both IMUs and an unambiguous leader.
  void update(Timestamp now, const RobotState& self, const RobotState& neighbor,
              const HypothesisSet& hypotheses, ReadingIntake& intake);
  /// Ignored without a pose of that time.
  void add_graph_correction(Timestamp stamp, const GraphPose& pose);
  /// Replaces the former one.
  void add_team_pose(TeamEstimate estimate) { team_ = std::move(estimate); }
  void end_team_pose() {
    team_.reset();
    team_pose_.reset();
    dispute_.reset();
  }
  /// Carries the newest team pose to now, and compares it with the filter's.
  void update_team(Timestamp now, const RobotState& self, const RobotState& neighbor,
                   const LastContact& last);
  /// True, once, when the team's pose has contradicted the filter's for a second: the filter must
  /// start anew. Measurements that the team's filter believes agree with others', too.
  [[nodiscard]] bool take_restart();

  /// The filter's pose at the last tick. Empty while unknown or too uncertain.
  [[nodiscard]] const std::optional<NeighborPose>& pose() const { return pose_; }
  /// The graph's edge: a certain pose with a recent sighting. Right after its start a filter
  /// does not know how the neighbor moves, and may follow a false hypothesis: it waits half a
  /// second and until the velocity is certain.
  [[nodiscard]] std::optional<NeighborEstimate> estimate() const;
  /// The team's pose if there is one and it agrees with the filter's. If they contradict each
  /// other, the filter's, with a covariance that contains the difference; none if that is too
  /// uncertain. While a filter that was contradicted starts anew, the team's, with that difference.
  /// Without a team's pose, or with one that needs to be confirmed and is not, the filter's,
  /// with the paper's graph's correction, if a recent one exists.
  [[nodiscard]] std::optional<NeighborPose> published() const;

 private:
  /// What every pose of that instant has, without the state itself, mode and age.
  [[nodiscard]] NeighborPose pose_at(Timestamp stamp, Timestamp now, const RobotState& neighbor,
                                     const LastContact& last) const;
  void compare();
  [[nodiscard]] bool is_disputed() const;  ///< at the last tick
  [[nodiscard]] std::optional<NeighborPose> graph_corrected_pose() const;

  struct StampedPose {
    Timestamp stamp;
    Pose T_B_N;
  };

  /// Difference of the graph's pose to the filter's at the same instant, in the axes that both
  /// bodies have at `axes`.
  struct Correction {
    Timestamp stamp;
    Timestamp axes;
    Vector6d step;
    Matrix6d covariance;
  };

  /// The team's pose contradicts the filter's.
  struct Dispute {
    Timestamp since;  ///< or since the filter last restarted; of comparisons without a pause
    Timestamp last = kNever;
    Timestamp axes = kNever;  ///< both bodies' axes then are those of the difference
    Vector6d difference = Vector6d::Zero();
    Timestamp restarted = kNever;
  };

  RobotId neighbor_;
  PairMounting mounting_;
  FilterSettings settings_;
  OutputPredictor predictor_;
  std::uint32_t generation_ = 0;  ///< of the hypothesis published last
  std::uint32_t starts_ = 0;
  Timestamp started_ = kNever;  ///< the latest of these
  std::optional<NeighborPose> pose_;
  double speed_sigma_ = 0.0;                    ///< of `pose_` [m/s]
  bool is_by_imus_ = false;                     ///< the distance in `pose_`
  bool is_half_contradicted_ = false;           ///< `pose_`, by one of the two robots
  BoundedFifo<StampedPose, 128> recent_poses_;  ///< of this hypothesis: half a second at 200 Hz
  std::optional<Correction> correction_;
  std::optional<TeamEstimate> team_;
  Timestamp team_since_ = kNever;          ///< what the team's pose goes back to
  std::optional<NeighborPose> team_pose_;  ///< at the last tick
  std::optional<Dispute> dispute_;         ///< until both agree
};

}  // namespace crepes
