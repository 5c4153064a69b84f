#include "daemon/ctl/live/check/robot_check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "daemon/ctl/live/check/mesh_check.hpp"
#include "daemon/ctl/live/check/sensor_check.hpp"
#include "daemon/ctl/live/check/sight_check.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

/// "12 deg to the left"; a direction in a plane, positive to the left.
std::string side_text(double deg) {
  constexpr double kStraight = 5.0;
  if (std::abs(deg) < kStraight) return "straight ahead";
  return fmt::format("{} deg to the {}", fixed(std::abs(deg), 0), deg > 0 ? "left" : "right");
}

/// Whether the daemon runs what its files say. Silent where it does.
void check_configuration(const RobotObservation& seen, CheckSection section) {
  if (seen.config && seen.config->robot.id.value != seen.after.self) {
    section.fault(fmt::format("--config is robot {}'s, this daemon is robot {}",
                              seen.config->robot.id.value, seen.after.self),
                  "name this daemon's own file, or ask the other robot (--address, --port)");
  }
  const auto& [fault, restart] = seen.config_state;
  if (!fault.empty()) {
    section.fault("the last reload was refused: " + fault,
                  "the earlier settings stay in use: correct the file, then systemctl reload "
                  "crepesd");
  }
  if (!restart.empty())
    section.doubt("changed, but not in use yet: " + restart, "systemctl restart crepesd");
}

}  // namespace

std::vector<CheckFinding> check_exposure(const client::Status& status) {
  std::vector<CheckFinding> findings;
  check_exposure(status, {"exposure", findings});
  return findings;
}

std::vector<CheckFinding> check_robot(const RobotObservation& seen) {
  std::vector<CheckFinding> findings;
  check_configuration(seen, {"configuration", findings});
  check_sensors(seen, {"sensors", findings});
  check_rates(seen, {"rates", findings});
  check_clocks(seen, {"clocks", findings});
  check_exposure(seen.after, {"exposure", findings});
  check_board(seen, {"board", findings});
  check_mesh(seen, {"mesh", findings});
  check_calibration(seen, {"calibration", findings});
  return findings;
}

std::string places_text(const std::map<RobotId, client::Pose>& poses) {
  constexpr double kUpsideDown = 90.0;  // deg
  std::string text;
  for (const auto& [id, message] : poses) {
    const NeighborPose pose = neighbor_pose_of(message);
    const Pose& T_B_N = pose.T_B_N.pose;
    const double bearing = kDegPerRad * std::atan2(T_B_N.p.y(), T_B_N.p.x());
    const double height = T_B_N.p.z();
    const Eigen::Vector3d up_N = T_B_N.R().col(2);
    const Eigen::Vector3d up = pose.up_B.value_or(Eigen::Vector3d::UnitZ());
    const double lean = kDegPerRad * std::acos(std::clamp(up_N.dot(up), -1.0, 1.0));
    text += fmt::format("  {} is {} m away, {}, {} m {} along our z{}\n", message.name,
                        fixed(T_B_N.p.norm(), 2), side_text(bearing), fixed(std::abs(height), 2),
                        height < 0 ? "below" : "above", lean > kUpsideDown ? ", upside down" : "");
  }
  return text;
}

}  // namespace crepes
