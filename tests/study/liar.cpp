#include "tests/study/liar.hpp"

#include <algorithm>

#include "estimator/core/constants.hpp"

namespace crepes::study {
namespace {

constexpr double kWrong = 2.0;           // m
constexpr double kClaimedSigma = 0.001;  // m and rad
constexpr double kTooLong = 1.0;         // m
constexpr Duration kStampedLate = std::chrono::milliseconds(20);

/// The robot goes by a camera that points elsewhere than the one that made the recording.
void turn_camera(Config& config, double angle_rad) {
  const Pose turn{Eigen::Vector3d::Zero(),
                  Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()))};
  for (CameraConfig& camera : config.cameras)
    camera.calibration.T_cam_imu = camera.calibration.T_cam_imu * turn;
}

void turn_imu(RobotRecording& robot, double angle_rad) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitX()));
  for (ImuSample& sample : robot.imu)
    sample = {sample.stamp, turn * sample.gyro_radps, turn * sample.accel_mps2};
}

void stamp_late(RobotRecording& robot) {
  for (ImuSample& sample : robot.imu) sample.stamp += kStampedLate;
  for (UwbRange& range : robot.ranges) range.stamp += kStampedLate;
  for (CameraRecording& camera : robot.cameras) {
    for (SpotFrame& frame : camera.spots) frame.stamp += kStampedLate;
    for (RecordedPicture& image : camera.images) image.stamp += kStampedLate;
  }
}

void lengthen(RobotRecording& robot, RobotId liar) {
  for (UwbRange& range : robot.ranges)
    if (robot.robot.id == liar || range.neighbor == liar) range.range_m += kTooLong;
}

/// To the others, each is where the other one's module is.
void swap_modules(SwarmDataset& dataset, RobotId a, RobotId b) {
  for (RobotRecording& robot : dataset.robots) {
    for (UwbRange& range : robot.ranges) {
      if (range.neighbor == a || range.neighbor == b) range.neighbor = range.neighbor == a ? b : a;
    }
  }
}

void corrupt(Lie lie, RobotRecording& robot) {
  switch (lie) {
    case Lie::kEstimates:
    case Lie::kAntennaDelay:
    case Lie::kModules:
      return;
    case Lie::kCamera5:
      return turn_camera(robot.config, radians(5.0));
    case Lie::kCamera20:
      return turn_camera(robot.config, radians(20.0));
    case Lie::kClock:
      return stamp_late(robot);
    case Lie::kRanges:
      return lengthen(robot, robot.robot.id);
    case Lie::kUpsideDown:
      return turn_imu(robot, radians(180.0));
    case Lie::kOnItsSide:
      return turn_imu(robot, radians(90.0));
  }
}

}  // namespace

void corrupt(Lie lie, RobotId robot, SwarmDataset& dataset) {
  for (RobotRecording& recording : dataset.robots) {
    if (recording.robot.id == robot) corrupt(lie, recording);
    if (lie == Lie::kAntennaDelay) lengthen(recording, robot);
  }
  if (lie != Lie::kModules) return;
  const auto is_other = [robot](const RobotRecording& r) { return r.robot.id != robot; };
  const auto other = std::ranges::find_if(dataset.robots, is_other);
  if (other != dataset.robots.end()) swap_modules(dataset, robot, other->robot.id);
}

std::function<void(Report&)> corrupted_reports(Lie lie, RobotId robot) {
  if (lie != Lie::kEstimates) return {};
  return [robot](Report& report) {
    if (report.sender != robot) return;
    for (NeighborEstimate& estimate : report.estimates) {
      // Each along another axis: one offset of all would be an error of the liar's place alone.
      estimate.T_B_N.pose.p(estimate.neighbor.value % 3) += kWrong;
      estimate.T_B_N.covariance = kClaimedSigma * kClaimedSigma * Matrix6d::Identity();
    }
  };
}

}  // namespace crepes::study
