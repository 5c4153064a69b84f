/// What a client last heard of one neighbor, and how it looks in a table.
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "daemon/ctl/daemon_client.hpp"

namespace crepes {

/// One standard deviation of a pose: the worst direction.
struct PoseSigma {
  double position_m = 0.0;
  double rotation_rad = 0.0;
};
[[nodiscard]] PoseSigma sigma_of(const Matrix6d& covariance);

/// Collects messages about one neighbor; times are the client's.
class NeighborView {
 public:
  void on_pose(const NeighborPose& pose, Timestamp now);
  void on_reason(std::string reason) { reason_ = std::move(reason); }

  /// The last pose, unless it is older than half a second.
  [[nodiscard]] const NeighborPose* pose(Timestamp now) const;
  /// Poses a second, over the last second or so; NaN until known.
  [[nodiscard]] double rate_hz(Timestamp now) const;
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  std::optional<NeighborPose> pose_;
  Timestamp heard_{};
  std::string reason_ = "no answer yet";
  Timestamp window_start_{};
  int in_window_ = 0;
  double rate_hz_ = std::numeric_limits<double>::quiet_NaN();  ///< not yet known
};

}  // namespace crepes
