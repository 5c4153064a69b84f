/// How much light a picture gets.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// What is not given stays as the device has it.
struct CameraLight {
  std::optional<double> exposure_us;
  std::optional<double> gain;  ///< in the device's own unit

  [[nodiscard]] bool operator==(const CameraLight&) const = default;
};

/// Who chooses the exposure.
enum class ExposureControl : std::uint8_t { kFixed, kAuto };
inline constexpr std::array kExposureControls{Choice{"fixed", ExposureControl::kFixed},
                                              Choice{"auto", ExposureControl::kAuto}};

/// A camera's light, as configured.
struct LightSettings {
  CameraLight light;  ///< with `kAuto`, `exposure_us` is the longest exposure
  ExposureControl exposure = ExposureControl::kFixed;

  [[nodiscard]] bool operator==(const LightSettings&) const = default;
};

}  // namespace crepes
