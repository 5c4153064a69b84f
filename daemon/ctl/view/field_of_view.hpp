/// What a camera sees, for the scene.
#pragma once

#include <string>

#include "estimator/core/camera_calibration.hpp"

namespace crepes {

/// `{"name","p","border"}`: the optical center in the body [m], and unit directions in the body in
/// order around the picture's border. Where a corner lies outside the lens's image circle, the
/// circle's border takes its place. "null" for a faulty calibration.
[[nodiscard]] std::string field_of_view_json(const CameraCalibration& camera);

}  // namespace crepes
