/// What a camera calibration found, as Kalibr's camchain, text and JSON.
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "estimator/calibration/camera_batch.hpp"

namespace crepes {

[[nodiscard]] std::string camchain_text(const CameraConstants& constants,
                                        const std::array<int, 2>& resolution);
[[nodiscard]] std::string camera_text(const CameraBatchResult& found, std::size_t boards,
                                      const std::filesystem::path& out);
[[nodiscard]] std::string camera_json(const CameraBatchResult& found, std::size_t boards);
/// RMS residuals in hundredths of a pixel over the image, a dot where nothing was seen.
[[nodiscard]] std::string map_text(const ResidualMap& map);

}  // namespace crepes
