/// Faint lights of one picture after another.
#pragma once

#include <span>
#include <vector>

#include "estimator/vision/blob_finder.hpp"
#include "estimator/vision/brightness_sample.hpp"
#include "estimator/vision/detection.hpp"
#include "estimator/vision/faint_light.hpp"
#include "estimator/vision/hot_pixel_map.hpp"
#include "estimator/vision/search_area.hpp"

namespace crepes {

/// Finds lights between the blobs that noise does not explain. Noise is unlikely to look like a
/// light twice in one place, so a light is found again with less significance where one was.
class FaintLightMemory {
 public:
  /// Blobs of more than `max_area_px2` hide no faint light near them. Nothing is allocated for
  /// less than 1024 lights.
  explicit FaintLightMemory(double max_area_px2);

  /// What is searched, and what is known of it.
  struct Scene {
    const GrayImage& image;
    const Background& level;
    std::span<const Blob> blobs;
    std::span<const FaintPeak> peaks;
    SearchArea area;
  };
  /// Forgets the lights of the last search, not the places.
  void clear() { lights_.clear(); }
  /// Replaces the lights of the last search. So many that they are texture are none. Counts what
  /// it refuses; what may be a hot pixel is suspected of it.
  void find(const Scene& scene, HotPixelMap& hot_pixels, Rejected& rejected);
  /// Updates the places with the lights of the last search, which was of a whole picture.
  void remember(std::span<const Blob> blobs);

  /// Those of the last search, the most significant first.
  [[nodiscard]] std::span<const FaintLight> lights() const { return lights_; }
  /// Whether it is so significant that it counts by itself, or stands where one was.
  [[nodiscard]] bool is_sure(const FaintLight& light) const;

 private:
  struct Place {
    int u = 0;
    int v = 0;
    int age = 0;    ///< pictures since
    int score = 0;  ///< rises with each picture that shows it, falls with each that does not
  };
  void add(const Scene& scene, const FaintPeak& at, const FaintSearch& search,
           HotPixelMap& hot_pixels, Rejected& rejected);
  void thin_out(std::span<const Blob> blobs);
  [[nodiscard]] bool is_near_blob(const Spot& spot, std::span<const Blob> blobs) const;

  double max_area_px2_;
  std::vector<FaintLight> lights_;
  std::vector<Place> places_;
};

}  // namespace crepes
