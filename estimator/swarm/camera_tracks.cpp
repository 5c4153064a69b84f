#include "estimator/swarm/camera_tracks.hpp"

#include <chrono>
#include <cmath>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

/// A stamp that is off by dt turns the direction by w dt.
Bearing with_stamp_error(Bearing bearing, double stamp_sigma_s, const ImuHistory& imu) {
  constexpr Duration kNear = std::chrono::milliseconds{10};
  if (imu.empty()) return bearing;
  const double w = imu.mean(bearing.stamp - kNear, bearing.stamp).gyro_radps.norm();
  bearing.sigma_rad = std::hypot(bearing.sigma_rad, stamp_sigma_s * w);
  return bearing;
}

}  // namespace

CameraTracks::CameraTracks(const EstimatorSettings& settings)
    : stamp_sigma_s_(1e-3 * settings.vision.stamp_sigma_ms) {
  const auto library = IdLibrary::from(settings.swarm);
  CREPES_EXPECT(library.has_value(), "validated: every member has a code of its own");
  for (const CameraCalibration& camera : settings.cameras) {
    const auto model = CameraModel::from(camera);
    CREPES_EXPECT(model.has_value(), "validated: every camera has a calibration");
    cameras_.push_back({BlinkTracker(camera, *model, settings.vision, *library, settings.self),
                        camera.calibrated});
  }
}

void CameraTracks::add_imu(const ImuSample& sample) {
  for (Camera& camera : cameras_) camera.tracker.add_imu(sample);
}

SeenBoards CameraTracks::step(const SpotFrame& frame, std::span<const ExpectedBoard> expected,
                              const ImuHistory& imu) {
  Camera& camera = cameras_[frame.camera];
  SeenBoards seen{.bearings = camera.tracker.step(frame, expected), .confirmed = {}};
  if (!camera.is_calibrated) return seen;
  seen.confirmed = camera.tracker.confirmed();
  for (Bearing& bearing : seen.bearings) bearing = with_stamp_error(bearing, stamp_sigma_s_, imu);
  for (Bearing& bearing : seen.confirmed) bearing = with_stamp_error(bearing, stamp_sigma_s_, imu);
  return seen;
}

void CameraTracks::write_to(EstimatorStatus& status) const {
  for (const Camera& camera : cameras_) {
    const TrackerStatus seen = camera.tracker.status();
    for (NeighborStatus& neighbor : status.neighbors) {
      const auto found = seen.decodes.find(neighbor.neighbor);
      if (found != seen.decodes.end()) neighbor.id_decodes += found->second;
    }
    status.predicted_ids.confirmed += seen.predicted_ids.confirmed;
    status.predicted_ids.unconfirmed += seen.predicted_ids.unconfirmed;
    status.foreign_boards += seen.foreign_boards;
  }
}

}  // namespace crepes
