/// The pixels of a camera that shine by themselves.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "estimator/vision/blob_finder.hpp"

namespace crepes {

/// Learns the pixels that shine in every picture. Every board is dark in some of a few hundred
/// pictures, and a lamp that is never dark is no board. A pixel is known after kKnown pictures, and
/// forgotten after a few pictures in which it is dark. The number of pixels is bounded.
class HotPixelMap {
 public:
  static constexpr int kKnown = 250;  ///< pictures: 1.3 s at 200 Hz, 8.3 s at 30 Hz
  static constexpr std::size_t kMaxSuspects = 8192;

  /// Nothing is allocated later.
  HotPixelMap();

  /// Updates all suspects with the next picture. A pixel shines if it is at least `level`.
  void add_frame(const GrayImage& image, int level);
  /// A pixel of a speck of light. Takes effect with the next add_frame().
  void suspect(int u, int v);
  /// Whether a suspect that is new would be taken before the next add_frame().
  [[nodiscard]] bool has_room() const;

  /// Ordered by row and column, with the median of their neighbors in the last picture.
  [[nodiscard]] std::span<const MendedPixel> known() const { return known_; }
  /// Those in the rows of the box; some may lie beside it.
  [[nodiscard]] std::span<const MendedPixel> in_rows_of(const PixelBox& box) const;
  [[nodiscard]] bool is_in(const PixelBox& box) const;

 private:
  struct Suspect {
    int u = 0;
    int v = 0;
    int score = 0;
  };
  [[nodiscard]] static bool is_before(const Suspect& a, const Suspect& b);
  void admit();

  int width_ = 0;
  int height_ = 0;
  std::vector<Suspect> suspects_;  ///< ordered by row and column
  std::vector<Suspect> new_;
  std::vector<MendedPixel> known_;
};

}  // namespace crepes
