/// Gray images to bright spots.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"
#include "estimator/vision/arc_joiner.hpp"
#include "estimator/vision/blob_finder.hpp"
#include "estimator/vision/brightness_sample.hpp"
#include "estimator/vision/detection.hpp"
#include "estimator/vision/faint_light_memory.hpp"
#include "estimator/vision/hot_pixel_map.hpp"
#include "estimator/vision/mended_spot.hpp"
#include "estimator/vision/ring_finder.hpp"
#include "estimator/vision/rings/fragment_joiner.hpp"
#include "estimator/vision/rings/led_separator.hpp"
#include "estimator/vision/search_area.hpp"
#include "estimator/vision/vision_config.hpp"

namespace crepes {

/// Finds LED boards: a ring of LEDs is one spot, be it a blob for each LED or one for all.
///
/// What is fainter than the threshold is a spot where the noise around it does not explain it.
/// Pixels that shine in every picture are learned and left out.
///
/// A picture with something huge and bright in it, as the sun or a window, is searched a second
/// and at last a third time, for what stands out before that. Each search is bounded, and all
/// memory is kept: nothing is allocated once it has seen a few frames.
class SpotDetector {
 public:
  explicit SpotDetector(const VisionConfig& config);

  /// `image` must be at most 2048 x 2048.
  [[nodiscard]] Detection detect(const GrayImage& image);

 private:
  [[nodiscard]] bool search_levels(const GrayImage& image, const BrightnessSample& sample,
                                   Detection& found);
  [[nodiscard]] bool search(const GrayImage& image, const Background& level, double contrast,
                            Rejected& rejected);
  void suspect_specks();
  void measure_open(const GrayImage& image, int threshold);
  void sort_out(const GrayImage& image, int threshold, double contrast, Rejected& rejected);
  [[nodiscard]] SearchArea area() const { return {huge_, candidates_}; }
  [[nodiscard]] bool is_whole_blob(const Ring& ring) const;
  void take_ring(const GrayImage& image, int threshold, const Ring& ring);
  void take_arcs(const GrayImage& image, int threshold, const JoinedArcs& arcs);
  [[nodiscard]] Blob take_blobs(std::span<const std::uint32_t> blobs, const RingView& view);
  void select(const GrayImage& image, Rejected& rejected);

  VisionConfig config_;
  BlobFinder finder_;
  LedSeparator separator_;
  RingFinder ring_finder_;
  ArcJoiner arc_joiner_;
  FragmentJoiner fragment_joiner_;
  MendedSpot mended_;
  HotPixelMap hot_pixels_;
  FaintLightMemory faint_;
  std::vector<std::uint32_t> of_ring_;  ///< its blobs
  std::vector<Blob> blobs_;
  std::vector<std::uint32_t> open_;  ///< blobs that are not accounted for yet, by first row
  std::vector<std::uint8_t> is_open_;
  std::vector<PixelBox> huge_;     ///< where to search
  std::span<const Light> lights_;  ///< of the blobs that were open
  std::vector<SpotCandidate> candidates_;
  std::vector<Spot> spots_;
  std::string failure_;
};

/// The paper's pipeline: binarize, then circles by a Hough transform. Appends to `spots`. Fails
/// where OpenCV does.
[[nodiscard]] Result<void> find_circles(const GrayImage& image, int threshold,
                                        const VisionConfig& config, std::vector<Spot>& spots);

}  // namespace crepes
