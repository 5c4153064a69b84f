#include "daemon/ctl/live/walk_around.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <istream>
#include <ostream>
#include <string_view>

#include "daemon/ctl/live/neighbor_view.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr double kSigmas = 3.0;

CheckFinding walk_finding(CheckVerdict verdict, std::string text, std::string advice = "") {
  return {"walk", verdict, std::move(text), std::move(advice)};
}

CheckFinding judge_distance(const NeighborPose& pose, double sigma_m, double distance_m) {
  constexpr double kTape_m = 0.05;
  const double found_m = pose.T_B_N.pose.p.norm();
  const double off_m = found_m - distance_m;
  const std::string text =
      fmt::format("distance {} m, by tape {} m", fixed(found_m, 2), fixed(distance_m, 2));
  if (std::abs(off_m) <= std::max(kTape_m, kSigmas * sigma_m))
    return walk_finding(CheckVerdict::kGood, text);
  return walk_finding(CheckVerdict::kFault, text,
                      "the ranges are biased, or a lever arm is wrong: crepesctl calibrate range; "
                      "measure p_body_uwb and p_body_led of both");
}

/// Of two robots that stand on one level floor, gravity has one direction, whatever the bearings
/// say.
CheckFinding judge_level(const NeighborPose& pose, double sigma_rad) {
  constexpr double kFloor_deg = 3.0;
  const Eigen::Vector3d up_B = pose.up_B.value_or(Eigen::Vector3d::UnitZ());
  const double lean_deg =
      kDegPerRad *
      std::acos(std::clamp((pose.T_B_N.pose.q * Eigen::Vector3d::UnitZ()).dot(up_B), -1.0, 1.0));
  const std::string text =
      fmt::format("it leans by {} deg against our gravity", fixed(lean_deg, 1));
  if (lean_deg <= std::max(kFloor_deg, kSigmas * sigma_rad * kDegPerRad))
    return walk_finding(CheckVerdict::kGood, text);
  return walk_finding(
      CheckVerdict::kFault, text,
      "gravity and bearings disagree: is the IMU mounted level (imu.T_body_imu), the camera "
      "calibrated on both robots? crepesctl calibrate imu, camera");
}

/// Left is positive. `expected` is the sign that it should have; 0 is ahead.
CheckFinding judge_side(double azimuth_deg, int expected) {
  constexpr double kAhead_deg = 30.0;
  constexpr double kAside_deg = 12.0;
  const std::string_view side = azimuth_deg > 0.0 ? "left" : "right";
  const std::string text =
      fmt::format("it is {} deg to the {}", fixed(std::abs(azimuth_deg), 0), side);
  if (expected == 0) {
    if (std::abs(azimuth_deg) < kAhead_deg) return walk_finding(CheckVerdict::kGood, text);
    return walk_finding(CheckVerdict::kFault, text + ", and stands ahead",
                        "the camera is taken to look elsewhere: T_cam_imu");
  }
  if (expected * azimuth_deg > kAside_deg) return walk_finding(CheckVerdict::kGood, text);
  if (expected * azimuth_deg < -kAside_deg)
    return walk_finding(CheckVerdict::kFault, text + ": sides are swapped",
                        "the camera is mounted upside down or its picture is mirrored: T_cam_imu, "
                        "and flips in the camera's driver");
  return walk_finding(CheckVerdict::kDoubt, text, "carry it further to the side and check again");
}

CheckFinding judge_height(const NeighborPose& pose) {
  constexpr double kLifted_m = 0.15;
  const double height_m = pose.T_B_N.pose.p.dot(pose.up_B.value_or(Eigen::Vector3d::UnitZ()));
  const std::string text = fmt::format("it is {} m {} us", fixed(std::abs(height_m), 2),
                                       height_m < 0.0 ? "below" : "above");
  if (height_m > kLifted_m) return walk_finding(CheckVerdict::kGood, text);
  if (height_m < -kLifted_m)
    return walk_finding(CheckVerdict::kFault, text + ": above and below are swapped",
                        "the camera is mounted upside down: T_cam_imu; or the IMU: "
                        "imu.T_body_imu");
  return walk_finding(CheckVerdict::kDoubt, text, "lift it by half a meter and check again");
}

CheckFinding judge_turned_over(const NeighborPose& pose) {
  constexpr double kOver = -0.7;  // cosine of the lean
  const Eigen::Vector3d up_B = pose.up_B.value_or(Eigen::Vector3d::UnitZ());
  if ((pose.T_B_N.pose.q * Eigen::Vector3d::UnitZ()).dot(up_B) < kOver)
    return walk_finding(CheckVerdict::kGood, "it is upside down");
  return walk_finding(CheckVerdict::kFault, "it seems to stand upright",
                      "its IMU does not report how it is turned: crepesctl check on that robot");
}

}  // namespace

std::string instruction_of(WalkStep step, const std::string& neighbor,
                           std::optional<double> distance_m) {
  switch (step) {
    case WalkStep::kAhead:
      return fmt::format("Stand {} on the floor in front of this robot, {}both upright.", neighbor,
                         distance_m ? fmt::format("{} m away, ", fixed(*distance_m, 2)) : "");
    case WalkStep::kLeft:
      return fmt::format("Carry {} to the left of that, as seen from this robot, by 45 deg.",
                         neighbor);
    case WalkStep::kRight:
      return fmt::format("Carry {} to the right, by 45 deg.", neighbor);
    case WalkStep::kLifted:
      return fmt::format("Lift {} by half a meter.", neighbor);
    case WalkStep::kUpsideDown:
      break;
  }
  return fmt::format("Turn {} upside down, its LEDs in view.", neighbor);
}

std::vector<CheckFinding> judge_walk(WalkStep step, const client::Pose& message,
                                     std::optional<double> distance_m) {
  const NeighborPose pose = neighbor_pose_of(message);
  const PoseSigma sigma = sigma_of(pose.T_B_N.covariance);
  const Eigen::Vector3d& p = pose.T_B_N.pose.p;
  const double azimuth_deg = kDegPerRad * std::atan2(p.y(), p.x());
  std::vector<CheckFinding> findings;
  switch (step) {
    case WalkStep::kAhead:
      if (distance_m) findings.push_back(judge_distance(pose, sigma.position_m, *distance_m));
      findings.push_back(judge_side(azimuth_deg, 0));
      findings.push_back(judge_level(pose, sigma.rotation_rad));
      break;
    case WalkStep::kLeft:
      findings.push_back(judge_side(azimuth_deg, 1));
      break;
    case WalkStep::kRight:
      findings.push_back(judge_side(azimuth_deg, -1));
      break;
    case WalkStep::kLifted:
      findings.push_back(judge_height(pose));
      break;
    case WalkStep::kUpsideDown:
      findings.push_back(judge_turned_over(pose));
      break;
  }
  return findings;
}

std::vector<CheckFinding> walk_around(const std::string& neighbor, std::optional<double> distance_m,
                                      const PoseNow& pose_now, std::istream& in,
                                      std::ostream& out) {
  std::vector<CheckFinding> findings;
  for (const WalkStep step : kWalkSteps) {
    out << instruction_of(step, neighbor, distance_m) << " Then press Enter (s: skip). "
        << std::flush;
    std::string line;
    if (!std::getline(in, line)) break;
    if (line == "s") continue;
    const auto pose = pose_now();
    const auto found =
        pose ? judge_walk(step, *pose, distance_m)
             : std::vector{walk_finding(CheckVerdict::kFault, "no pose of " + neighbor,
                                        "is it in view? crepesctl watch says why there is none")};
    for (const CheckFinding& finding : found)
      out << "  " << name_of(finding.verdict) << ": " << finding.text << '\n';
    findings.insert(findings.end(), found.begin(), found.end());
  }
  if (findings.empty())
    findings.push_back(walk_finding(CheckVerdict::kDoubt, "no step was done", "walk again"));
  return findings;
}

}  // namespace crepes
