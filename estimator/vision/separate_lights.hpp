/// Every light of a picture by itself, as the LEDs of a calibration grid.
#pragma once

#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/vision/blob_finder.hpp"

namespace crepes {

/// Lights that stand out from the dark part of the picture, by contrast, at most 300. Lights
/// that bloom into each other are parted at the saddle between them; those that the picture's
/// border cuts are left out. Unlike `SpotDetector`, which makes one spot of a board's LEDs.
[[nodiscard]] std::vector<Spot> separate_lights(const GrayImage& image);

}  // namespace crepes
