#include "daemon/ctl/calibrate/calibrate_camera.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "daemon/ctl/calibrate/board_sightings.hpp"
#include "daemon/ctl/calibrate/camera_report.hpp"
#include "estimator/calibration/camera/camera_start.hpp"
#include "estimator/calibration/imu/vibration.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr double kShareOfTracking = 0.2;
constexpr double kAnyFov_deg = 180.0;

/// The guess: crepesd.yaml's Double Sphere, else a generic lens of the field of view that was said.
LensVector lens_guess(const CameraCalibration& camera, const std::optional<double>& fov_deg) {
  const bool is_usable = camera.camera_model == CameraModelKind::kDoubleSphere &&
                         camera.intrinsics.size() == 6 && !fov_deg;
  if (is_usable) return Eigen::Map<const LensVector>(camera.intrinsics.data());
  return generic_lens(camera.resolution[0], camera.resolution[1],
                      radians(fov_deg.value_or(kAnyFov_deg)));
}

CameraCalibration with_lens(CameraCalibration camera, const LensVector& lens) {
  camera.camera_model = CameraModelKind::kDoubleSphere;
  camera.intrinsics.assign(lens.begin(), lens.end());
  camera.distortion_model = DistortionModel::kNone;
  camera.distortion_coeffs.clear();
  return camera;
}

/// First without the gyroscope, as nobody knows yet how the camera is mounted; then with it.
Result<BoardSightings> find_boards(const RobotRecording& recording, CameraCalibration camera,
                                   const LensVector& lens) {
  auto found = board_sightings(recording, camera, false);
  if (!found) return found;
  const auto aligned = align_camera(recording.imu, found->sightings, lens);
  if (!aligned) return found;
  CameraConstants guess;
  guess.q_C_B = aligned->q_C_B;
  guess.p_B_C = camera.T_cam_imu.inverse().p;
  camera.T_cam_imu = guess.T_C_B();
  return board_sightings(recording, camera, true);
}

std::vector<std::string> names_of(const BoardSightings& found, const SwarmConfig& swarm) {
  std::vector<std::string> names;
  for (const RobotId id : found.boards) {
    const auto member = std::ranges::find(swarm.members, id, &MemberConfig::id);
    names.push_back("board " +
                    (member == swarm.members.end() ? std::to_string(id.value) : member->name));
  }
  return names;
}

}  // namespace

Result<CalibrationReport> calibrate_camera(const CalibrateCameraOptions& options) {
  if (const auto free = check_results({options.out}, "camera", options.force); !free)
    return tl::unexpected(free.error());
  CalibrationReport report;
  const auto recording =
      load_robot(options.robot_dir, {.imu = true, .ranges = false, .cameras = true}, report.faults);
  if (!recording) return tl::unexpected(recording.error());
  const CameraCalibration& camera = recording->config.cameras.front().calibration;
  const LensVector lens = lens_guess(camera, options.fov_deg);
  const auto found = find_boards(*recording, with_lens(camera, lens), lens);
  if (!found) return tl::unexpected(found.error());
  const auto progress = [&](double done) {
    if (options.on_progress)
      options.on_progress(kShareOfTracking + (1.0 - kShareOfTracking) * done);
  };
  progress(0.0);

  const CameraBatchResult result = calibrate_camera(
      recording->imu, found->sightings, names_of(*found, recording->config.swarm),
      {.width = camera.resolution[0],
       .height = camera.resolution[1],
       .lens = lens,
       .p_B_C = camera.T_cam_imu.inverse().p,
       .noise = noise_with_vibration(recording->config.imu.noise, recording->imu, 8),
       .on_progress = progress});
  const auto reported =
      report_camera(result, {.words = "boards", .key = "boards", .count = found->boards.size()},
                    {.out = options.out,
                     .resolution = camera.resolution,
                     .kannala_brandt = options.kannala_brandt,
                     .json = options.json},
                    report);
  if (!reported) return tl::unexpected(reported.error());
  return report;
}

}  // namespace crepes
