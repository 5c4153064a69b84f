/// The team as a peer sees it, for a robot in the dark.
#pragma once

#include <optional>

#include "estimator/team/team_filter.hpp"

namespace crepes {

/// A robot that sees nobody, and that nobody sees, knows of the others only their distances. Then a
/// second filter estimates the team in the frame of a peer that sees others, as that peer itself
/// does. It begins with what this robot believed until then, if that is known. There ranges hold or
/// place this robot like any other one that nobody sees, and the belief is turned into this robot's
/// frame (`root_change`). Deterministic.
class PeerView {
 public:
  /// Intervals must follow each other. `own` is what this robot's own filter believed before it.
  /// Empty unless this robot has been in the dark for a second, and has a place in the peer's
  /// frame.
  [[nodiscard]] std::optional<TeamSolution> step(const TeamInterval& interval,
                                                 const TeamBelief& own);

 private:
  void choose_peer(const TeamInterval& interval, const TeamBelief& own);
  void forget();

  Timestamp lit_ = kNever;       ///< when this robot was last seen or saw anybody
  Timestamp peer_lit_ = kNever;  ///< likewise the peer
  RobotId peer_{};               ///< whose frame it is; RobotId{} if there is none
  RobotId former_{};             ///< one that turned out to have a fault
  TeamFilter filter_;
};

}  // namespace crepes
