/// The center and size of a spot, from all of its light.
#pragma once

#include "estimator/core/measurements.hpp"
#include "estimator/vision/blob_finder.hpp"

namespace crepes {

/// What lies around a blob.
struct Surroundings {
  int margin = 0;           ///< px around the blob's box without other blobs, at most 2
  double background = 0.0;  ///< mean gray level two pixels outside the box, without other blobs
  double crest = 0.0;       ///< the same in the middle of the box's sides, nearest to the blob
  bool is_known = false;    ///< false when there is nothing but other blobs
};

/// The pixel in which the center is.
[[nodiscard]] PixelBox pixel_of(const Spot& spot);

[[nodiscard]] Surroundings surroundings_of(const GrayImage& image, const PixelBox& box,
                                           int threshold);

/// Pixels above the threshold; of a blob of a few, with the flanks that rise half as high. A lens
/// spreads light over more than one pixel: what has an area of 1 is a hot pixel.
[[nodiscard]] int area_of(const GrayImage& image, const Blob& blob, int threshold,
                          const Surroundings& around);

/// A threshold cuts the flanks of a faint spot, and its center then leans towards the middle of a
/// pixel. So the flanks below the threshold are weighed too, where no other blob is near.
[[nodiscard]] Spot measure_spot(const GrayImage& image, const Blob& blob, int threshold,
                                const Surroundings& around);

}  // namespace crepes
