/// Gray images to bright spots.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"
#include "estimator/vision/arc_joiner.hpp"
#include "estimator/vision/blob_finder.hpp"
#include "estimator/vision/brightness_sample.hpp"
#include "estimator/vision/faint_light.hpp"
#include "estimator/vision/hot_pixel_map.hpp"
#include "estimator/vision/ring_finder.hpp"
#include "estimator/vision/spot_measure.hpp"
#include "estimator/vision/vision_config.hpp"

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

  Rejected& operator+=(const Rejected& other);
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
  struct Candidate {
    Spot spot;
    PixelBox box;
  };

  [[nodiscard]] bool search_levels(const GrayImage& image, const BrightnessSample& sample,
                                   Detection& found);
  [[nodiscard]] bool search(const GrayImage& image, const Background& level, double contrast,
                            Rejected& rejected);
  void suspect_specks();
  void measure_open(const GrayImage& image, int threshold);
  [[nodiscard]] std::optional<Spot> measure_mended(const GrayImage& image, const PixelBox& box,
                                                   int threshold);
  void find_faint(const GrayImage& image, const Background& level, Rejected& rejected);
  void add_faint(const GrayImage& image, int u, int v, const FaintSearch& search,
                 Rejected& rejected);
  void thin_out_faint();
  void remember_faint();
  [[nodiscard]] bool is_near_blob(const Spot& spot) const;
  void sort_out(const GrayImage& image, int threshold, double contrast, Rejected& rejected);
  [[nodiscard]] bool is_news(const PixelBox& box) const;
  void find_lights(const GrayImage& image, int threshold);
  void split(const GrayImage& image, std::uint32_t index, int threshold);
  [[nodiscard]] bool is_whole_blob(const Ring& ring) const;
  void take_ring(const GrayImage& image, int threshold, const Ring& ring);
  void take_arcs(const GrayImage& image, int threshold, const JoinedArcs& arcs);
  [[nodiscard]] Blob take_blobs(std::span<const std::uint32_t> blobs, const RingView& view);
  void join_fragments();
  [[nodiscard]] std::uint32_t group_of(std::uint32_t place);
  void select(Rejected& rejected);

  VisionConfig config_;
  BlobFinder finder_;
  BlobFinder splitter_;
  RingFinder ring_finder_;
  ArcJoiner arc_joiner_;
  HotPixelMap hot_pixels_;
  std::vector<FaintLight> faint_;
  /// Where a faint light was.
  struct FaintPlace {
    int u = 0;
    int v = 0;
    int age = 0;    ///< pictures since
    int score = 0;  ///< rises with each picture that shows it, falls with each that does not
  };
  std::vector<FaintPlace> faint_places_;
  std::vector<std::uint8_t> patch_;
  std::vector<std::uint32_t> of_ring_;  ///< its blobs
  std::vector<Blob> blobs_;
  std::vector<std::uint32_t> open_;  ///< blobs that are not accounted for yet, by first row
  std::vector<std::uint8_t> is_open_;
  std::vector<PixelBox> huge_;  ///< where to search
  std::vector<Light> lights_;
  std::vector<Blob> cores_;
  std::vector<std::uint32_t> parent_;  ///< union-find over places in open_
  std::vector<Blob> groups_;           ///< sums over its sets, at the first place of each
  std::vector<Candidate> candidates_;
  std::vector<Spot> spots_;
  std::string failure_;
};

/// The paper's pipeline: binarize, then circles by a Hough transform. Appends to `spots`. Fails
/// where OpenCV does.
[[nodiscard]] Result<void> find_circles(const GrayImage& image, int threshold,
                                        const VisionConfig& config, std::vector<Spot>& spots);

}  // namespace crepes
