#include "estimator/vision/mended_spot.hpp"

#include <algorithm>
#include <cstddef>

#include "estimator/vision/spot_measure.hpp"

namespace crepes {

std::optional<Spot> MendedSpot::measure(const GrayImage& image, const PixelBox& box, int threshold,
                                        const HotPixelMap& hot_pixels) {
  const PixelBox wide = box.grown(2 * kReach_px);
  const PixelBox around{std::max(0, wide.u_min), std::max(0, wide.v_min),
                        std::min(image.width - 1, wide.u_max),
                        std::min(image.height - 1, wide.v_max)};
  const GrayImage patch = mend(image, around, hot_pixels);
  const PixelBox inside{box.u_min - around.u_min, box.v_min - around.v_min,
                        box.u_max - around.u_min, box.v_max - around.v_min};
  blobs_.clear();
  if (!finder_.find(patch, threshold, max_area_px2_, blobs_)) return std::nullopt;
  std::erase_if(blobs_, [&](const Blob& blob) { return !blob.box.overlaps(inside); });
  if (blobs_.empty()) return std::nullopt;
  for (std::size_t i = 1; i < blobs_.size(); ++i) blobs_[0].absorb(blobs_[i]);
  const Surroundings near = surroundings_of(patch, blobs_[0].box, threshold);
  Spot spot = measure_spot(patch, blobs_[0], threshold, near);
  spot.u_px += around.u_min;
  spot.v_px += around.v_min;
  return spot;
}

/// A copy of a part of the image in which hot pixels show what is around them.
GrayImage MendedSpot::mend(const GrayImage& image, const PixelBox& part,
                           const HotPixelMap& hot_pixels) {
  patch_.clear();
  for (int v = part.v_min; v <= part.v_max; ++v)
    patch_.insert(patch_.end(), image.row(v) + part.u_min, image.row(v) + part.u_max + 1);
  for (const MendedPixel& pixel : hot_pixels.in_rows_of(part)) {
    if (part.u_min <= pixel.u && pixel.u <= part.u_max) {
      patch_[static_cast<std::size_t>((pixel.v - part.v_min) * part.width() + pixel.u -
                                      part.u_min)] = pixel.level;
    }
  }
  return {patch_.data(), part.width(), part.height(), part.width()};
}

}  // namespace crepes
