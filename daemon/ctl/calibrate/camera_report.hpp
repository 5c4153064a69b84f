/// What a camera calibration found, as Kalibr's camchain, text and JSON.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "estimator/calibration/camera/camera_batch.hpp"
#include "estimator/calibration/camera/lens_conversion.hpp"

namespace crepes {

/// Kalibr's camchain: a Double Sphere, or if `kb` is given, Kannala and Brandt's model of it.
/// `command` is the one that wrote it.
[[nodiscard]] std::string camchain_text(const CameraConstants& constants,
                                        const std::array<int, 2>& resolution,
                                        const std::optional<KannalaBrandtFit>& kb,
                                        std::string_view command = "camera");
[[nodiscard]] std::string camera_text(const CameraBatchResult& found, std::size_t boards,
                                      const std::optional<KannalaBrandtFit>& kb,
                                      const std::filesystem::path& out);
[[nodiscard]] std::string camera_json(const CameraBatchResult& found, std::size_t boards,
                                      const std::optional<KannalaBrandtFit>& kb);
/// RMS residuals in hundredths of a pixel over the image, a dot where nothing was seen.
[[nodiscard]] std::string map_text(const ResidualMap& map);

}  // namespace crepes
