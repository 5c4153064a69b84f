/// The messages of one daemon, thinned to what the page shows. Pure.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/ctl/view/pose_history.hpp"

namespace crepes {

/// A robot as the page lists it.
struct ViewedRobot {
  RobotId id{};
  std::string name;

  bool operator==(const ViewedRobot&) const = default;
};

/// Keeps the newest pose of each neighbor and the newest STATUS of each kind. Times are the
/// client's.
class LiveMessages {
 public:
  explicit LiveMessages(DaemonAddress daemon) : daemon_(std::move(daemon)) {}

  void add(const client::Answer& answer, Timestamp now);

  /// The events since the last call: `frame` with the poses that are new, `status` for each STATUS,
  /// `link` when the daemon falls silent or answers again.
  [[nodiscard]] std::string drain(Timestamp now);
  /// What a page that opens now has missed.
  [[nodiscard]] std::string greeting(Timestamp now) const;

  /// Empty until the daemon has answered.
  [[nodiscard]] const std::optional<ViewedRobot>& robot() const { return robot_; }
  [[nodiscard]] const PoseHistory& poses() const { return poses_; }
  /// In the order of their ids.
  [[nodiscard]] const std::vector<RobotId>& neighbors() const { return neighbors_; }

 private:
  struct StatusEvent {
    std::string kind;
    std::string event;
  };

  void add_status(const client::Status& status, const std::string& text);
  [[nodiscard]] bool is_silent(Timestamp now) const;
  [[nodiscard]] std::string link_event(bool is_silent) const;

  DaemonAddress daemon_;
  std::map<RobotId, NeighborPose> new_poses_;
  PoseHistory poses_;
  std::string new_statuses_;           ///< as events
  std::vector<StatusEvent> statuses_;  ///< the newest of each kind, the oldest first
  std::optional<Timestamp> last_message_;
  std::optional<bool> reported_silent_;
  std::optional<ViewedRobot> robot_;
  std::vector<RobotId> neighbors_;
};

}  // namespace crepes
