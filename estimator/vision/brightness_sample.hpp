/// What counts as bright in a picture.
#pragma once

#include <array>

#include "estimator/vision/blob_finder.hpp"

namespace crepes {

/// The brightness of one part of a picture: a dark room, say, or the window in its wall.
struct Background {
  int median = 0;     ///< gray level
  int threshold = 0;  ///< at most kHighestThreshold; from here on a pixel stands out
  /// From here on noise alone is rare: 1 pixel in 10^4. At most the threshold.
  int faint = 0;
};

/// The gray levels of a sample of a picture's pixels.
class BrightnessSample {
 public:
  static constexpr int kHighestThreshold = 250;

  explicit BrightnessSample(const GrayImage& image);

  /// The darkest part among pixels of at least `level`.
  [[nodiscard]] Background darkest_from(int level) const;
  /// The part of all pixels that has at least `level`, 0..1.
  [[nodiscard]] double share_from(int level) const;

 private:
  [[nodiscard]] int quantile(int first, int last, double part) const;
  [[nodiscard]] double exact_quantile(int first, int last, double part) const;
  [[nodiscard]] int faint_from(int first, int last) const;

  std::array<int, 257> below_{};  ///< samples below each level
};

}  // namespace crepes
