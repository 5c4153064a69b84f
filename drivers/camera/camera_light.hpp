/// How much light a picture gets.
#pragma once

#include <optional>

namespace crepes {

/// What is not given stays as the device has it.
struct CameraLight {
  std::optional<double> exposure_us;
  std::optional<double> gain;  ///< in the device's own unit

  [[nodiscard]] bool operator==(const CameraLight&) const = default;
};

}  // namespace crepes
