/// Where a detector looks for spots.
#pragma once

#include <algorithm>
#include <span>

#include "estimator/core/measurements.hpp"
#include "estimator/vision/blob_finder.hpp"

namespace crepes {

/// What may be a spot of the picture, and all of its light.
struct SpotCandidate {
  Spot spot;
  PixelBox box;
};

/// Parts of a picture, without the spots that are known in them. A view of what others own.
struct SearchArea {
  std::span<const PixelBox> parts;
  std::span<const SpotCandidate> known;

  /// Whether the box reaches into the area and touches nothing that is known.
  [[nodiscard]] bool has(const PixelBox& box) const {
    const auto overlaps = [&](const PixelBox& part) { return part.overlaps(box); };
    return std::any_of(parts.begin(), parts.end(), overlaps) &&
           std::none_of(known.begin(), known.end(), [&](const SpotCandidate& candidate) {
             return candidate.box.overlaps(box);
           });
  }
};

}  // namespace crepes
