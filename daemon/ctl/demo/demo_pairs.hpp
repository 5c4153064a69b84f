/// What each robot of a demo says of each other one, and how far that is from the truth.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/ctl/demo/demo_screen.hpp"
#include "daemon/ctl/demo/demo_summary.hpp"
#include "daemon/ctl/live/neighbor_view.hpp"
#include "drivers/dataset/robot_clock.hpp"
#include "drivers/sim/world.hpp"
#include "net/client/client.hpp"

namespace crepes {

/// The ordered pairs of a simulated swarm. Times are the machine's clock unless a name says
/// `world`.
class DemoPairs {
 public:
  /// `world` outlives this. World time 0 was at `start`. Poses older than `kept` before the newest
  /// are forgotten, if it is given.
  DemoPairs(const SimWorld& world, Timestamp start, std::optional<Duration> kept)
      : world_(world), start_(start), kept_(kept) {}

  /// Expects poses of all the other robots in the world by this one, stamped by `clock`.
  void add_observer(RobotId observer, RobotClock clock);
  void handle(RobotId observer, const client::Message& message, Timestamp now);

  [[nodiscard]] std::vector<DemoRow> live_rows(Timestamp now) const;
  /// Scores what was said of this part of world time, in s.
  [[nodiscard]] std::vector<DemoSummary::Pair> score(double from_world_s, double to_world_s) const;

 private:
  struct Pair {
    RobotId observer;
    RobotId neighbor;
    NeighborView view;
    std::vector<NeighborPose> poses;
    std::optional<Duration> first_pose;  ///< after the start
  };

  void add_pose(Pair& pair, NeighborPose pose, Timestamp now);
  [[nodiscard]] DemoRow live_row(const Pair& pair, Timestamp now) const;
  [[nodiscard]] Pose truth(const Pair& pair, Timestamp stamp) const;

  const SimWorld& world_;
  Timestamp start_;
  std::optional<Duration> kept_;
  std::map<RobotId, RobotClock> clocks_;
  std::vector<Pair> pairs_;
  std::map<std::pair<RobotId, RobotId>, std::size_t> index_;
};

}  // namespace crepes
