/// What to change about a camera's exposure; pure.
#pragma once

#include <string>
#include <string_view>

#include "net/client/client.hpp"

namespace crepes {

/// What stands behind the camera's name in that of its spots.
inline constexpr std::string_view kSpotsSuffix = " spots";

/// Whether a sensor's line is about a camera's spots: its counts have the gray levels.
[[nodiscard]] bool is_spots(const client::Status::Sensor& sensor);

/// From the `counts` of a camera's spots, in both directions: the brightest board should just be
/// white and the faintest stand out of the noise. Empty if the exposure fits.
[[nodiscard]] std::string light_advice(const client::Status::Totals& counts);

}  // namespace crepes
