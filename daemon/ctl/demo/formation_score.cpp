#include "daemon/ctl/demo/formation_score.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr double kSampleRateHz = 50.0;
constexpr RobotId kLeader{1};
constexpr RobotId kLeft{2};
constexpr RobotId kRight{3};

/// The follower's position in the leader's axes without its roll and pitch.
Eigen::Vector3d p_L_follower(const SimWorld& world, RobotId follower, double t_s) {
  const Pose T_W_B = world.T_W_B(kLeader, t_s);
  const Eigen::Matrix3d R_W_B = T_W_B.q.toRotationMatrix();
  const Eigen::AngleAxisd R_L_W(-std::atan2(R_W_B(1, 0), R_W_B(0, 0)), Eigen::Vector3d::UnitZ());
  return R_L_W * (world.T_W_B(follower, t_s).p - T_W_B.p);
}

bool is_hidden(const SimWorld& world, RobotId a, RobotId b, double t_s) {
  return world.is_occluded(world.T_W_B(a, t_s).p, world.T_W_B(b, t_s).p);
}

}  // namespace

Eigen::Vector3d formation_place(RobotId follower) {
  const double side = follower == kLeft ? 0.5 : -0.5;
  return kFormationSide * Eigen::Vector3d(std::sqrt(0.75), side, 0.0);
}

FormationScore score_formation(const SimWorld& world, double from_s, double to_s) {
  FormationScore score{.from_s = from_s, .to_s = to_s};
  const int samples = static_cast<int>(kSampleRateHz * (to_s - from_s));
  if (samples <= 0) return score;
  double sum_sq = 0.0;
  int hidden = 0;
  for (int i = 0; i < samples; ++i) {
    const double t_s = from_s + i / kSampleRateHz;
    for (const RobotId follower : {kLeft, kRight}) {
      const double error = (p_L_follower(world, follower, t_s) - formation_place(follower)).norm();
      sum_sq += error * error;
      score.max_m = std::max(score.max_m, error);
      if (is_hidden(world, kLeader, follower, t_s)) ++hidden;
    }
    if (is_hidden(world, kLeft, kRight, t_s)) ++hidden;
  }
  score.rms_m = std::sqrt(sum_sq / (2.0 * samples));
  score.hidden = hidden / (3.0 * samples);
  return score;
}

}  // namespace crepes
