/// Kalibr's camchain: the file in which the calibration of one camera is kept.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "estimator/calibration/camera/camera_state.hpp"
#include "estimator/calibration/camera/lens_conversion.hpp"
#include "estimator/core/camera_calibration.hpp"

namespace crepes {

/// What a batch problem found: a Double Sphere, or if `kb` is given, Kannala and Brandt's model of
/// it.
[[nodiscard]] CameraCalibration calibration_of(const CameraConstants& constants,
                                               const std::array<int, 2>& resolution,
                                               const std::optional<KannalaBrandtFit>& kb);

/// Whether a camchain says how the camera is mounted.
enum class Mounting : std::uint8_t {
  kKnown,
  kUnknown,  ///< no T_cam_imu, no timeshift_cam_imu
};

/// `command` is the one that wrote it.
[[nodiscard]] std::string camchain_text(const CameraCalibration& camera, Mounting mounting,
                                        std::string_view command);

}  // namespace crepes
