/// The newest information of a client about one neighbor.
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

/// One standard deviation of a pose in its worst direction.
struct PoseSigma {
  double position_m = 0.0;
  double rotation_rad = 0.0;
};
[[nodiscard]] PoseSigma sigma_of(const Matrix6d& covariance);

/// The neighbor that a user means: by its name as `crepesctl status` shows it, or by its id.
[[nodiscard]] std::optional<RobotId> neighbor_named(const client::Status& status,
                                                    const std::string& name_or_id);

/// Collects messages about one neighbor; times are the client's.
class NeighborView {
 public:
  void update(const NeighborPose& pose, Timestamp now);
  void set_reason(std::string reason) { reason_ = std::move(reason); }

  /// The last pose, unless it is older than half a second.
  [[nodiscard]] const NeighborPose* pose(Timestamp now) const;
  /// Poses per second, over about the last second; NaN until known.
  [[nodiscard]] double rate_hz(Timestamp now) const;
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  std::optional<NeighborPose> pose_;
  Timestamp received_at_{};
  std::string reason_ = "no answer yet";
  Timestamp window_start_{};
  int in_window_ = 0;
  double rate_hz_ = std::numeric_limits<double>::quiet_NaN();  ///< not yet known
};

}  // namespace crepes
