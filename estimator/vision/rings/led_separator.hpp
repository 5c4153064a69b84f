/// The LEDs of boards whose lights touch.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimator/vision/blob_finder.hpp"
#include "estimator/vision/rings/light_field.hpp"

namespace crepes {

/// What may be single LEDs: small blobs, and the parts of larger ones. LEDs whose flanks touch are
/// apart at a higher level.
class LedSeparator {
 public:
  /// Nothing is allocated for less than 1024 lights.
  explicit LedSeparator(double max_area_px2);

  /// The lights of the blobs `open`, which are those of the finder's last find() at `threshold`.
  /// Valid until the next call.
  [[nodiscard]] std::span<const Light> find(const GrayImage& image, int threshold,
                                            std::span<const std::uint32_t> open,
                                            std::span<const Blob> blobs, const BlobFinder& finder);

 private:
  struct Whole {
    const Blob& blob;
    std::uint32_t index = 0;
  };
  void split(const GrayImage& image, int threshold, const Whole& whole, const BlobFinder& finder);

  double max_area_px2_;
  BlobFinder splitter_;
  std::vector<Blob> cores_;
  std::vector<Light> lights_;
};

}  // namespace crepes
