/// Gray images to bright spots.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/vision/ring_finder.hpp"

namespace crepes {

/// An 8-bit image that someone else owns.
struct GrayImage {
  const std::uint8_t* pixels = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next
};

enum class Exposure : std::uint8_t {
  kGood,
  kDark,    ///< nothing stands out
  kBright,  ///< so much does that spots cannot be told: exposure is too long; no spots are given
};

struct Detection {
  std::span<const Spot> spots;  ///< brightest first; valid until the next detect()
  int threshold = 0;            ///< grey level from which a pixel belongs to a spot
  Exposure exposure = Exposure::kGood;
};

/// Finds LED boards: a ring of six LEDs is one spot, be it six blobs or one. Hot pixels and the
/// sun are left out. Allocates nothing once it has seen a few frames.
class SpotDetector {
 public:
  explicit SpotDetector(const VisionConfig& config) : config_(config) {}

  /// `image` must be at most 2048 x 2048.
  [[nodiscard]] Detection detect(const GrayImage& image);

 private:
  struct Run {
    int row = 0;
    int begin = 0;
    int end = 0;
    std::uint32_t parent = 0;  ///< union-find over runs
  };

  void find_runs(const std::uint8_t* row, int v, int width);
  [[nodiscard]] bool scan(const GrayImage& image);
  [[nodiscard]] std::uint32_t root_of(std::uint32_t run);
  void link_rows();
  void measure(const GrayImage& image);
  void join_fragments();
  void select();

  VisionConfig config_;
  int threshold_ = 0;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> blob_of_;
  std::vector<Blob> blobs_;
  RingFinder rings_;
  std::vector<Spot> spots_;
};

/// Median and spread of a sample of the image's pixels decide what stands out.
[[nodiscard]] int automatic_threshold(const GrayImage& image);

/// The paper's pipeline: binarize, then circles by a Hough transform. Appends to `spots`.
void find_circles(const GrayImage& image, int threshold, const VisionConfig& config,
                  std::vector<Spot>& spots);

}  // namespace crepes
