/// What a camera calibration found, as text and JSON.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "estimator/calibration/camera/camera_batch.hpp"
#include "estimator/calibration/camera/lens_conversion.hpp"

namespace crepes {

[[nodiscard]] std::string camera_text(const CameraBatchResult& found, std::size_t boards,
                                      const std::optional<KannalaBrandtFit>& kb,
                                      const std::filesystem::path& out);
[[nodiscard]] std::string camera_json(const CameraBatchResult& found, std::size_t boards,
                                      const std::optional<KannalaBrandtFit>& kb);
/// RMS residuals in hundredths of a pixel over the image, a dot where nothing was seen.
[[nodiscard]] std::string map_text(const ResidualMap& map);

}  // namespace crepes
