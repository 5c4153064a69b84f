#include "estimator/vision/rings/led_separator.hpp"

#include <cmath>

namespace crepes {
namespace {

constexpr std::size_t kUsualLights = 1024;
constexpr int kSplitMinSide = 6;    // px; smaller blobs show no ring
constexpr int kSplitMaxSide = 100;  // px; LEDs of larger rings do not touch
constexpr int kSplitLevels = 3;     // up to this one
constexpr int kHighestSplit = 250;  // gray level

Light light_of(const Blob& blob, std::uint32_t index) {
  return {blob.mean_u(), blob.mean_v(), blob.area, blob.peak, index};
}

}  // namespace

LedSeparator::LedSeparator(double max_area_px2) : max_area_px2_(max_area_px2) {
  cores_.reserve(kUsualLights);
  lights_.reserve(kUsualLights);
}

std::span<const Light> LedSeparator::find(const GrayImage& image, int threshold,
                                          std::span<const std::uint32_t> open,
                                          std::span<const Blob> blobs, const BlobFinder& finder) {
  lights_.clear();
  for (const std::uint32_t i : open) {
    const Blob& blob = blobs[i];
    if (blob.box.shorter_side() >= kSplitMinSide && blob.box.longer_side() <= kSplitMaxSide) {
      split(image, threshold, {blob, i}, finder);
    } else if (blob.area > 1) {
      lights_.push_back(light_of(blob, i));
    }
  }
  return lights_;
}

/// The level that shows most lights counts; a blob in one piece stays one light.
void LedSeparator::split(const GrayImage& image, int threshold, const Whole& whole,
                         const BlobFinder& finder) {
  const PixelBox& box = whole.blob.box;
  const GrayImage patch{image.row(box.v_min) + box.u_min, box.width(), box.height(), image.stride};
  const std::size_t first = lights_.size();
  lights_.push_back(light_of(whole.blob, whole.index));
  for (int k = 1; k <= kSplitLevels; ++k) {
    const int level = threshold + (kHighestSplit - threshold) * k / kSplitLevels;
    cores_.clear();
    if (level <= threshold || !splitter_.find(patch, level, max_area_px2_, cores_)) continue;
    const std::size_t before = lights_.size();
    for (const Blob& core : cores_) {
      Light light = light_of(core, whole.index);
      light.u += box.u_min;
      light.v += box.v_min;
      const auto owner = finder.blob_at(static_cast<int>(std::lround(light.u)),
                                        static_cast<int>(std::lround(light.v)));
      if (owner == whole.index) lights_.push_back(light);
    }
    const std::size_t shown = lights_.size() - before;
    if (shown > before - first) {
      lights_.erase(lights_.begin() + static_cast<std::ptrdiff_t>(first),
                    lights_.begin() + static_cast<std::ptrdiff_t>(before));
    } else {
      lights_.resize(before);
    }
  }
}

}  // namespace crepes
