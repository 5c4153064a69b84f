/// A camera on a moving body: spots in pixels to directions in body axes, and when they were
/// exposed.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/imu_history.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/pose.hpp"
#include "estimator/core/time.hpp"
#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/tracking/light_sighting.hpp"

namespace crepes {

/// A lens with its extrinsics and the timing of its shutter. Directions seen by a rolling shutter
/// are turned by the gyro from the exposure of their row to the frame's stamp. Stamps are body
/// time.
class CameraView {
 public:
  CameraView(const CameraCalibration& camera, CameraModel model);

  /// The camera's stamp in body time.
  [[nodiscard]] Timestamp body_time(Timestamp camera_stamp) const {
    return camera_stamp + timeshift_;
  }
  [[nodiscard]] const Eigen::Vector3d& p_B_C() const { return T_B_C_.p; }

  /// Fills `sightings` with the directions of a frame's spots in the body at `stamp`, ordered by
  /// direction; at most `most`. Returns how many spots were refused: not finite, outside the image
  /// circle, or too many.
  [[nodiscard]] std::size_t unproject(const SpotFrame& frame, Timestamp stamp,
                                      const ImuHistory& imu, std::size_t most,
                                      std::vector<LightSighting>& sightings) const;

  /// When the row that sees `u_B` is exposed in the frame at `stamp`; `stamp` if none sees it.
  [[nodiscard]] Timestamp exposure_of(const Eigen::Vector3d& u_B, Timestamp stamp) const;
  /// Whether `u_B` is in the picture.
  [[nodiscard]] bool contains(const Eigen::Vector3d& u_B) const {
    return pixel_of(u_B).has_value();
  }

 private:
  [[nodiscard]] Timestamp row_exposure(double v_px, Timestamp stamp) const;
  [[nodiscard]] std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector3d& u_B) const;

  CameraModel model_;
  Pose T_B_C_;
  Pose T_C_B_;
  Duration timeshift_{};
  double row_delay_s_ = 0.0;  ///< of a rolling shutter
};

}  // namespace crepes
