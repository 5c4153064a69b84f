/// Pictures for the recorder, and what was found in them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/stages/bounded_queue.hpp"
#include "drivers/camera/camera.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/vision/blob_finder.hpp"

namespace crepes {

/// A picture in memory of its own, and what the detector says of it.
struct Picture {
  static constexpr std::size_t kMaxHotPixels = 256;

  Frame frame;
  std::vector<Spot> spots;
  std::vector<MendedPixel> hot_pixels;  ///< at most kMaxHotPixels of those that are known
  std::size_t hot_pixel_count = 0;
  int background = 0;            ///< see Detection
  int threshold = 0;             ///< see Detection
  double saturated_share = 0.0;  ///< of the picture, 0..1
};

/// A picture is copied only on request.
struct PictureTap {
  struct Request {};
  BoundedQueue<Request> requests{1, Overflow::kDropNewest};
  BoundedQueue<Picture> pictures{1, Overflow::kDropNewest};
};

/// The robots that were identified in one picture.
struct PictureRobots {
  Timestamp stamp{};        ///< of the picture
  std::uint8_t camera = 0;  ///< index into the configured cameras
  std::vector<Bearing> bearings;
};

using PictureRobotsQueue = BoundedQueue<PictureRobots>;

}  // namespace crepes
