/// Everything that this robot knows about one neighbor.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>

#include "estimator/core/config.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/swarm/event_sequencer.hpp"
#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/hypotheses.hpp"
#include "estimator/swarm/look_ahead.hpp"
#include "estimator/swarm/robot_state.hpp"
#include "estimator/swarm/sighting_log.hpp"

namespace crepes {

/// Gathers readings from both sides, starts and feeds the neighbor's filter, and says where it is
/// now. Readings wait in the sequencer until the lag has passed; poses do not wait: they come from
/// a copy of the filter that runs ahead over what is still waiting.
class Neighbor {
 public:
  Neighbor(const MemberConfig& self, const MemberConfig& neighbor, const FilterSettings& settings);

  /// Other settings from now on; what is known of the neighbor stays known, but for another
  /// profile.
  void reconfigure(const FilterSettings& settings);

  void add_bearing(const Bearing& bearing);
  void add_range(const UwbRange& range);
  void add_report(const ReceivedReport& received, const RobotState& self);
  void add_graph_pose(Timestamp stamp, const GraphPose& pose);

  /// Moves on to `now`: fuses what has waited long enough and looks ahead.
  void tick(Timestamp now, const RobotState& self);

  /// The pose at the last tick, by the filter alone. Empty while unknown or too uncertain.
  [[nodiscard]] const std::optional<NeighborPose>& pose() const { return pose_; }
  /// What the graph may use: a certain pose that rests on a recent sighting.
  [[nodiscard]] std::optional<NeighborEstimate> estimate() const;
  /// The last pose with the graph's correction, where there is a fresh one.
  [[nodiscard]] std::optional<NeighborPose> improved_pose() const;

  /// Keeps what became of each measurement, and what the filter believes of the sensors at each
  /// tick, until `take_records`.
  void keep_records() { keeps_records_ = true; }
  [[nodiscard]] Records take_records() { return std::exchange(records_, {}); }

  [[nodiscard]] const RobotState& body() const { return body_; }
  [[nodiscard]] Timestamp last_heard() const { return last_heard_; }
  [[nodiscard]] NeighborStatus status() const;

 private:
  void take_range(const UwbRange& range, MeasurementKind kind);
  void take_peer_estimate(const NeighborEstimate& estimate);
  void take_peer_bearing(const Bearing& bearing, double clock_sigma_s, const RobotState& self);
  void enqueue(Measurement measurement);
  void note(Timestamp stamp, MeasurementKind kind, const Fusion& fusion);
  void release(Timestamp now, const RobotState& self);
  void find_pose(Timestamp now, const RobotState& self);
  void start(std::span<const Measurement> group, const RobotState& self);
  void try_one_way(Timestamp now, const RobotState& self);
  [[nodiscard]] bool is_a_start(const Measurement& measurement) const;
  [[nodiscard]] NoPoseReason reason(Timestamp now, const RobotState& self) const;

  MemberConfig member_;
  RobotId self_id_;
  PairMounting mounting_;
  FilterSettings settings_;

  RobotState body_;
  SightingLog sightings_;
  EventSequencer sequencer_;
  Hypotheses hypotheses_;
  LookAhead look_ahead_;
  std::uint32_t generation_ = 0;  ///< of the hypothesis that was published last
  std::uint32_t starts_ = 0;

  // What the last tick found.
  std::optional<NeighborPose> pose_;
  NoPoseReason reason_ = NoPoseReason::kNeverHeard;

  // The graph's latest word, as the difference to this filter at that instant.
  struct Correction {
    Timestamp stamp;
    Vector6d step;
    Matrix6d covariance;
  };
  std::optional<Correction> correction_;

  Timestamp last_heard_ = kNever;
  Timestamp last_seen_ = kNever;
  Timestamp last_seen_by_ = kNever;
  Timestamp last_range_ = kNever;
  Timestamp one_way_since_ = kNever;
  bool one_way_lasts_ = false;
  double late_share_ = 0.0;  ///< of the latest ranges, those whose first path is weak
  NoPoseReason raw_reason_ = NoPoseReason::kNotSeen;
  NeighborStatus status_;

  bool keeps_records_ = false;
  Records records_;
};

}  // namespace crepes
