/// What the team's filter knows of each robot, and where that is in its covariance.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"
#include "estimator/relative/error_state.hpp"
#include "estimator/team/belief/robot_trajectory.hpp"

namespace crepes {

/// The lower id first.
using RobotPair = std::pair<RobotId, RobotId>;

/// The pair with the lower id first.
[[nodiscard]] inline RobotPair ordered(RobotId a, RobotId b) {
  return a < b ? RobotPair(a, b) : RobotPair(b, a);
}

/// How many readings of a source agreed with the filter of late, and how many its gate refused. The
/// past is forgotten within half a second, or within eight readings where they are rarer, but two
/// seconds at most.
struct Agreement {
  double fused = 0.0;
  double gated = 0.0;
  double passed_s = 0.0;              ///< since the readings before these
  int readings = 0;                   ///< since then
  std::array<double, 3> periods_s{};  ///< of the latest readings

  /// A time passes; the readings of this time come after it.
  void pass(double dt_s) {
    constexpr double kMemory = 0.5;
    constexpr double kLongestMemory = 2.0;
    constexpr double kReadings = 8.0;
    if (readings > 0) {
      std::shift_right(periods_s.begin(), periods_s.end(), 1);
      periods_s.front() = passed_s / readings;
      passed_s = 0.0;
      readings = 0;
    }
    passed_s += dt_s;
    const double period_s = *std::ranges::min_element(periods_s);  // one gap says nothing
    fade(std::exp(-dt_s / std::clamp(kReadings * period_s, kMemory, kLongestMemory)));
  }
  /// Scales both counts.
  void fade(double kept) {
    fused *= kept;
    gated *= kept;
  }
  /// Counts a reading.
  void add(bool fits) {
    (fits ? fused : gated) += 1.0;
    ++readings;
  }
  /// Most are refused, and not only a few outliers.
  [[nodiscard]] bool is_contradiction() const { return gated > 4.0 && gated > fused; }
};

/// What is known of one camera of a robot.
struct TeamCamera {
  Eigen::Vector3d p_B_C = Eigen::Vector3d::Zero();
  static constexpr int kStates = 6;  ///< [misalignment, lens]

  Eigen::Vector3d misalignment = Eigen::Vector3d::Zero();  ///< m, see `seen`
  Eigen::Vector3d lens = Eigen::Vector3d::Zero();          ///< c, see `seen` [rad]
  int index = 0;                                           ///< of its states
  std::map<RobotId, Agreement> agreement{};  ///< of its bearings, by the robot that it sees
  bool is_free = false;     ///< it may be turned: its prior allowed for any misalignment
  bool is_refused = false;  ///< it contradicted the others after that, too

  /// Where the camera sees what is in this true direction (body axes): Exp(m) u, moved towards c by
  /// the part of c across. Besides a rotation, a principal point that is off does just that to the
  /// directions of a circle through the optical axis, and a focal length nearly, with c along it.
  [[nodiscard]] Eigen::Vector3d seen(const Eigen::Vector3d& u) const;
  [[nodiscard]] int lens_index() const { return index + 3; }
};

/// What is known of one robot.
struct TeamRobot {
  /// [gyroscope and accelerometer bias, the gyroscope's scale errors, antenna delay, clock]
  static constexpr int kCalibration = FreeMotionAt::kBias + 2;
  /// A robot that for so long saw nobody, and that nobody saw, is in the dark.
  static constexpr Duration kUnseenAfter = std::chrono::seconds{1};

  FreeMotion motion{};
  ImuBias bias{};
  double antenna_delay_m = 0.0;  ///< of its module; lengthens all its ranges
  /// How far its clock is ahead of this robot's [s]. Its motion is kept on its own clock.
  double clock_s = 0.0;
  int motion_index = -1;  ///< none for this robot
  int bias_index = 0;
  std::vector<TeamCamera> cameras{};
  Timestamp last_sighting = kNever;
  Timestamp last_fix = kNever;  ///< in the dark, by the ranges of robots that are seen
  Timestamp since{};
  /// Measurements between a robot on probation and trusted robots correct the former only.
  bool is_trusted = false;

  [[nodiscard]] int delay_index() const { return bias_index + FreeMotionAt::kBias; }
  [[nodiscard]] int clock_index() const { return delay_index() + 1; }
  /// Whether it is in the dark.
  [[nodiscard]] bool is_unseen(Timestamp now) const { return now - last_sighting >= kUnseenAfter; }
};

/// The error of all ranges between two robots that their modules' antenna delays do not explain.
struct TeamRangeBias {
  double bias_m = 0.0;
  int index = 0;
  std::map<RobotId, Agreement> agreement{};  ///< of the ranges that this robot measured
  std::map<RobotId, double> refused_m{};     ///< mean of the latest residuals that were refused

  /// Counts a range that `observer` measured.
  void add(RobotId observer, bool fits, double residual_m) {
    constexpr double kWeight = 0.1;
    agreement[observer].add(fits);
    if (fits) return;
    double& mean_m = refused_m.try_emplace(observer, residual_m).first->second;
    mean_m += kWeight * (residual_m - mean_m);
  }
};

}  // namespace crepes
