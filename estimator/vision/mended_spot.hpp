/// Spots with hot pixels in or beside them.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/vision/blob_finder.hpp"
#include "estimator/vision/hot_pixel_map.hpp"

namespace crepes {

/// Measures spots as they would be without the hot pixels.
class MendedSpot {
 public:
  static constexpr int kReach_px = 3;  ///< so far away hot pixels matter to a center

  explicit MendedSpot(double max_area_px2) : max_area_px2_(max_area_px2) {}

  /// The spot above `threshold` in the box; empty if it is nothing without hot pixels.
  [[nodiscard]] std::optional<Spot> measure(const GrayImage& image, const PixelBox& box,
                                            int threshold, const HotPixelMap& hot_pixels);

 private:
  [[nodiscard]] GrayImage mend(const GrayImage& image, const PixelBox& part,
                               const HotPixelMap& hot_pixels);

  double max_area_px2_;
  std::vector<std::uint8_t> patch_;
  BlobFinder finder_;
  std::vector<Blob> blobs_;
};

}  // namespace crepes
