/// A camera's picture with all that is drawn over it. Pure.
#pragma once

#include <cstddef>
#include <string>

#include "config/schema/config.hpp"
#include "daemon/ctl/view/pose_history.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// One object for the page, from a `look` of the daemon (recorder_stage.hpp): its numbers, with
/// `robots` as rows of id, u, v (where each was identified) and `predicted` as the same rows (where
/// its pose says that its board is), all in the camera's pixels; and `jpeg`, the picture, in
/// base64. An error if it is of another camera.
[[nodiscard]] Result<std::string> picture_json(const std::string& look, std::size_t camera,
                                               const Config& config, const PoseHistory& poses);

/// What the page says of the cameras without a picture: `cameras` with `name`, `exposure_us`,
/// `gain` and `field` (see `field_of_view_json`), `threshold`, `control`, and unless it is empty
/// `reason`, why there is no picture.
[[nodiscard]] std::string cameras_json(const Config& config, bool control,
                                       const std::string& reason);

}  // namespace crepes
