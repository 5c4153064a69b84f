#include "estimator/vision/spot_measure.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr int kSpotMargin = 2;          // px
constexpr int kMaxFlankSide = 64;       // px; larger spots have nothing to gain from their flanks
constexpr std::int32_t kFewPixels = 4;  // pixels
constexpr double kPixel = 1.0 / 12.0;   // variance of a single pixel's own extent

PixelBox grown(const PixelBox& box, int by, const GrayImage& image) {
  return {std::max(0, box.u_min - by), std::max(0, box.v_min - by),
          std::min(image.width - 1, box.u_max + by), std::min(image.height - 1, box.v_max + by)};
}

/// Calls visit(level, is_middle) for the pixels on the edge of the box that is `distance` larger;
/// is_middle for those in the middle half of a side.
template <class Visit>
void walk_edge(const GrayImage& image, const PixelBox& box, int distance, const Visit& visit) {
  const PixelBox edge = grown(box, distance, image);
  const auto is_middle = [](int x, int first, int last) {
    return 2 * std::abs(2 * x - first - last) <= last - first + 1;
  };
  for (const int v : {box.v_min - distance, box.v_max + distance}) {
    if (v < 0 || v >= image.height) continue;
    for (int u = edge.u_min; u <= edge.u_max; ++u)
      visit(image.row(v)[u], is_middle(u, box.u_min, box.u_max));
  }
  const int first = std::max(0, box.v_min - distance + 1);
  const int last = std::min(image.height - 1, box.v_max + distance - 1);
  for (const int u : {box.u_min - distance, box.u_max + distance}) {
    if (u < 0 || u >= image.width) continue;
    for (int v = first; v <= last; ++v) visit(image.row(v)[u], is_middle(v, box.v_min, box.v_max));
  }
}

/// The mean of what was added.
struct Mean {
  int sum = 0;
  int count = 0;

  void add(int level) {
    sum += level;
    ++count;
  }
  [[nodiscard]] double value() const { return static_cast<double>(sum) / std::max(1, count); }
};

/// Sums of light above the background, which may be negative in single pixels.
struct Moments {
  double weight = 0.0, u = 0.0, v = 0.0, uu = 0.0, uv = 0.0, vv = 0.0;

  Moments(const GrayImage& image, const PixelBox& window, double background) {
    for (int y = window.v_min; y <= window.v_max; ++y) {
      for (int x = window.u_min; x <= window.u_max; ++x) {
        const double w = image.row(y)[x] - background;
        const double du = x - window.u_min;
        const double dv = y - window.v_min;
        weight += w;
        u += w * du;
        v += w * dv;
        uu += w * du * du;
        uv += w * du * dv;
        vv += w * dv * dv;
      }
    }
  }

  [[nodiscard]] double elongation() const {
    const double var_uu = uu / weight - u * u / (weight * weight) + kPixel;
    const double var_vv = vv / weight - v * v / (weight * weight) + kPixel;
    const double var_uv = uv / weight - u * v / (weight * weight);
    const double middle = 0.5 * (var_uu + var_vv);
    const double swing = std::hypot(0.5 * (var_uu - var_vv), var_uv);
    return std::sqrt(std::max(middle + swing, kPixel) / std::max(middle - swing, kPixel));
  }
};

int count_from(const GrayImage& image, const PixelBox& box, double level) {
  int count = 0;
  for (int v = box.v_min; v <= box.v_max; ++v)
    for (int u = box.u_min; u <= box.u_max; ++u) count += image.row(v)[u] >= level ? 1 : 0;
  return count;
}

}  // namespace

PixelBox pixel_of(const Spot& spot) {
  const auto u = static_cast<int>(std::lround(spot.u_px));
  const auto v = static_cast<int>(std::lround(spot.v_px));
  return {u, v, u, v};
}

Surroundings surroundings_of(const GrayImage& image, const PixelBox& box, int threshold) {
  Surroundings around;
  for (int distance = 1; distance <= kSpotMargin; ++distance) {
    Mean all;
    Mean middle;
    bool is_free = true;
    walk_edge(image, box, distance, [&](int level, bool is_middle) {
      if (level >= threshold) {
        is_free = false;
        return;
      }
      all.add(level);
      if (is_middle) middle.add(level);
    });
    if (is_free && around.margin == distance - 1) around.margin = distance;
    around.is_known = all.count > 0;
    around.background = all.value();
    around.crest = middle.count > 0 ? middle.value() : all.value();
  }
  return around;
}

int area_of(const GrayImage& image, const Blob& blob, int threshold, const Surroundings& around) {
  if (blob.area >= kFewPixels || !around.is_known) return blob.area;
  const double half = 0.5 * (around.background + threshold);
  return std::max(blob.area, count_from(image, grown(blob.box, 1, image), half));
}

Spot measure_spot(const GrayImage& image, const Blob& blob, int threshold,
                  const Surroundings& around) {
  Spot spot{.u_px = blob.mean_u(),
            .v_px = blob.mean_v(),
            .area_px2 = static_cast<double>(area_of(image, blob, threshold, around)),
            .peak = static_cast<double>(blob.peak),
            .elongation = blob.elongation()};
  if (around.margin < kSpotMargin || blob.box.width() > kMaxFlankSide ||
      blob.box.height() > kMaxFlankSide)
    return spot;
  const PixelBox window = grown(blob.box, kSpotMargin, image);
  const Moments light(image, window, around.background);
  if (light.weight < blob.peak - around.background) return spot;  // more dark than light in there
  const double u_px = window.u_min + light.u / light.weight;
  const double v_px = window.v_min + light.v / light.weight;
  if (std::abs(u_px - spot.u_px) > 1.0 || std::abs(v_px - spot.v_px) > 1.0) return spot;
  spot.u_px = u_px;
  spot.v_px = v_px;
  spot.elongation = light.elongation();
  return spot;
}

}  // namespace crepes
