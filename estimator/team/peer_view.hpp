/// The team as a peer sees it, for a robot that sees or knows nobody.
#pragma once

#include <optional>

#include "estimator/team/team_filter.hpp"

namespace crepes {

/// A robot that sees nobody does not know how the team is turned about it, but for what the IMUs
/// tell in time. In its own frame that is an error of all others' places, which is not linear, and
/// a filter would soon be too certain. If nobody sees it either, it knows of the others only their
/// distances. If it measures no ranges, no estimate tells it of anybody. Then a second filter
/// estimates the team in the frame of a peer that sees others, as that peer itself does. There this
/// robot is like any other one, whose heading is open, or which ranges hold, or ranges or bearings
/// place. It begins with what this robot believed until then, if that is known. The belief is
/// turned into this robot's frame (`root_change`). Deterministic.
class PeerView {
 public:
  /// The team in this robot's frame.
  struct View {
    TeamSolution solution;
    std::optional<TeamBelief> belief;  ///< what the own filter goes on from, if this robot is seen
  };

  /// Intervals must follow each other. `own` is what this robot's own filter believed before it.
  /// Empty unless this robot has seen nobody, or known nobody, for a second and has a place in the
  /// peer's frame.
  [[nodiscard]] std::optional<View> step(const TeamInterval& interval, const TeamBelief& own);

 private:
  void choose_peer(const TeamInterval& interval, const TeamBelief& own);
  void forget();

  Timestamp last_saw_ = kNever;       ///< when this robot last saw anybody
  Timestamp last_seen_ = kNever;      ///< when anybody last saw it
  Timestamp last_knew_ = kNever;      ///< when its own filter last knew anybody
  Timestamp peer_last_saw_ = kNever;  ///< when the peer last saw anybody
  RobotId peer_{};                    ///< whose frame it is; RobotId{} if there is none
  RobotId former_{};                  ///< one that turned out to have a fault
  TeamFilter filter_;
};

}  // namespace crepes
