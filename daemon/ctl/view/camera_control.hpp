/// Exposure, gain and threshold, as the page sets them.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "daemon/ctl/view/camera_feed.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Writes what `wanted` has of `exposure_us`, `gain` and `threshold` to fragments of `file`, the
/// configuration of the daemon behind `feed`, and has the daemon reload. Refused unless
/// `view.control` is true there. The result of the reload is in STATUS.
[[nodiscard]] Result<void> change_camera(const CameraFeed& feed, const std::filesystem::path& file,
                                         std::size_t camera,
                                         const std::map<std::string, std::string>& wanted);

}  // namespace crepes
