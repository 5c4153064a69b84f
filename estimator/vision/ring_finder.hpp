/// Blobs of one image, and the boards that several of them make up.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace crepes {

/// Sums over connected pixels, weighted by how far each rises above the threshold.
struct Blob {
  std::int64_t weight = 0;
  std::int64_t u = 0, v = 0;            ///< weighted
  std::int64_t uu = 0, uv = 0, vv = 0;  ///< weighted
  std::int32_t area = 0;                ///< pixels
  int u_min = 0, u_max = 0, v_min = 0, v_max = 0;
  int peak = 0;
  bool is_part = false;     ///< went into another blob
  bool has_center = false;  ///< `center_u`, `center_v` replace the center of weight
  double center_u = 0.0, center_v = 0.0;

  [[nodiscard]] double mean_u() const {
    return has_center ? center_u : static_cast<double>(u) / static_cast<double>(weight);
  }
  [[nodiscard]] double mean_v() const {
    return has_center ? center_v : static_cast<double>(v) / static_cast<double>(weight);
  }
};

/// Adds `part` to `whole`, which keeps its center of weight.
void absorb(Blob& whole, Blob& part);

/// Joins the LEDs of boards so near that each LED is a blob of its own.
///
/// Any three neighbors a, b, c on a regular hexagon have its center at a + c - b, and an affine
/// view keeps that true. So every blob votes for a center with each two of its near neighbors; two
/// votes at one place make a ring of four to six LEDs, and their mean its center, no matter which
/// LEDs are hidden.
class RingFinder {
 public:
  /// Marks the blobs that went into others as parts. Appends nothing.
  void join(std::vector<Blob>& blobs);

 private:
  struct Vote {
    double u = 0.0, v = 0.0;
    double radius = 0.0;
    std::array<std::uint32_t, 3> members{};
  };

  std::vector<std::uint32_t> order_;
  std::vector<Vote> votes_;
};

}  // namespace crepes
