/// Bearings of a recorded swarm against its truth.
#pragma once

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/ctl/dataset/truth.hpp"
#include "drivers/camera/image_folder.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/vision/blink_tracker.hpp"
#include "estimator/vision/spot_detector.hpp"

namespace crepes::test {

/// What one camera reported of one neighbor.
struct SeenNeighbor {
  std::size_t visible = 0;     ///< frames with a spot where the neighbor's ring is
  std::size_t identified = 0;  ///< of them, with a bearing to it
  std::size_t wrong = 0;       ///< bearings far from it
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> astray_W;  ///< those, and the truth
  std::vector<Eigen::Vector3d> measured_B;
  std::vector<Eigen::Vector3d> true_B;

  /// RMS angle [rad] about the constant rotation that fits best: what a mounting error leaves.
  [[nodiscard]] double rms_rad() const {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < true_B.size(); ++i) H += true_B[i] * measured_B[i].transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d D = Eigen::Matrix3d::Identity();
    D(2, 2) = (svd.matrixV() * svd.matrixU().transpose()).determinant();
    const Eigen::Matrix3d R = svd.matrixV() * D * svd.matrixU().transpose();
    double sum = 0.0;
    for (std::size_t i = 0; i < true_B.size(); ++i)
      sum += (R * true_B[i] - measured_B[i]).squaredNorm();
    return std::sqrt(sum / static_cast<double>(true_B.size()));
  }
};

/// Makes spots of the pictures of `robot`'s first camera.
inline void detect_spots(RobotRecording& robot) {
  SpotDetector detector(robot.config.vision);
  CameraRecording& camera = robot.cameras.front();
  for (const RecordedPicture& image : camera.images) {
    const auto picture = read_gray_image(image.file).value();
    const Detection found = detector.detect({.pixels = picture.pixels.data(),
                                             .width = picture.width,
                                             .height = picture.height,
                                             .stride = picture.width});
    SpotFrame frame{.stamp = image.stamp, .camera = 0, .spots = {}};
    frame.spots.assign(found.spots.begin(), found.spots.end());
    camera.spots.push_back(std::move(frame));
  }
}

/// Runs the tracker alone over what `robot`'s first camera recorded, from `after` its first frame.
inline std::map<RobotId, SeenNeighbor> watch_neighbors(const RobotRecording& robot,
                                                       const SwarmTruth& truth, Duration after) {
  constexpr double kSpotRadius = radians(0.6);  // mounting error and noise
  const CameraCalibration& camera = robot.config.cameras.front().calibration;
  const CameraModel model = CameraModel::from(camera).value();
  const IdLibrary library = IdLibrary::from(robot.config.swarm).value();
  BlinkTracker tracker(camera, model, robot.config.vision, library, robot.robot.id);
  const Pose T_B_C = camera.T_cam_imu.inverse();
  const Duration shift = from_seconds(camera.timeshift_cam_imu);

  std::map<RobotId, SeenNeighbor> seen;
  auto imu = robot.imu.begin();
  const auto& frames = robot.cameras.front().spots;
  for (const SpotFrame& frame : frames) {
    const Timestamp stamp = frame.stamp + shift;
    for (; imu != robot.imu.end() && imu->stamp <= stamp; ++imu) tracker.add_imu(*imu);
    const std::vector<Bearing> bearings = tracker.step(frame);
    if (frame.stamp - frames.front().stamp < after) continue;
    for (const MemberConfig& member : robot.config.swarm.members) {
      if (member.id == robot.robot.id) continue;
      const auto T_B_N = truth.relative(robot.robot.id, member.id, stamp);
      if (!T_B_N) continue;
      SeenNeighbor& neighbor = seen[member.id];
      const Eigen::Vector3d u_B = (*T_B_N * member.p_body_led - T_B_C.p).normalized();
      const bool is_visible =
          std::any_of(frame.spots.begin(), frame.spots.end(), [&](const Spot& spot) {
            const auto u_C = model.unproject({spot.u_px, spot.v_px});
            return u_C && (T_B_C.q * *u_C - u_B).norm() < kSpotRadius;
          });
      bool is_identified = false;
      for (const Bearing& bearing : bearings) {
        if (bearing.neighbor != member.id) continue;
        if ((bearing.u_B - u_B).norm() > 2.0 * kSpotRadius) {
          ++neighbor.wrong;
          const auto T_W_B = truth.pose(robot.robot.id, robot.robot.clock.true_s(stamp));
          if (T_W_B) neighbor.astray_W.emplace_back(T_W_B->q * bearing.u_B, T_W_B->q * u_B);
          continue;
        }
        is_identified = true;
        neighbor.measured_B.push_back(bearing.u_B);
        neighbor.true_B.push_back(u_B);
      }
      neighbor.visible += is_visible ? 1 : 0;
      neighbor.identified += is_visible && is_identified ? 1 : 0;
    }
  }
  return seen;
}

}  // namespace crepes::test
