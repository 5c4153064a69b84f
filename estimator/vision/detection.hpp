/// What a detector says of one picture.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "estimator/core/measurements.hpp"
#include "estimator/vision/blob_finder.hpp"

namespace crepes {

/// Whether the exposure of a picture suits the detector.
enum class Exposure : std::uint8_t {
  kGood,
  kDark,    ///< nothing stands out
  kBright,  ///< a quarter of the picture or more is saturated, all of it bright, or it is all noise
};

/// What stood out and was no spot.
struct Rejected {
  std::uint64_t hot = 0;      ///< smaller than min_area_px2: hot pixels
  std::uint64_t huge = 0;     ///< larger than max_area_px2: the sun, windows
  std::uint64_t faint = 0;    ///< crests of a bright background
  std::uint64_t surplus = 0;  ///< more than max_spots
  std::uint64_t cut = 0;      ///< by the border of the picture: half a board shows its own middle

  Rejected& operator+=(const Rejected& other) {
    hot += other.hot;
    huge += other.huge;
    faint += other.faint;
    surplus += other.surplus;
    cut += other.cut;
    return *this;
  }
};

/// The spots of one picture, and how the picture is exposed.
struct Detection {
  std::span<const Spot> spots;  ///< brightest first; valid until the next detect()
  int background = 0;           ///< median gray level of the darkest part of the picture
  int threshold = 0;            ///< gray level from which a pixel there belongs to a spot
  int faint_threshold = 0;      ///< from which it may; then the noise around it decides
  Exposure exposure = Exposure::kGood;
  double saturated_share = 0.0;  ///< of the picture, 0..1
  Rejected rejected;
  /// Known ones, which no longer count as rejected; valid until the next detect().
  std::span<const MendedPixel> hot_pixels;
  std::string_view failure;  ///< why the detector failed on this picture; empty when it did not
};

}  // namespace crepes
