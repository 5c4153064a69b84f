#include "estimator/vision/faint_light.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr int kInner = 4;  // px, of the surroundings
constexpr int kOuter = 8;
constexpr int kStep = 2;                     // px; filters overlap by little
constexpr int kReach = 2;                    // px, of the light
constexpr int kFaintMargin = 2 * kReach;     // px
constexpr double kLeastFlanks = 3.0;         // sigmas of what is beside its brightest pixel
constexpr double kQuantization = 1.0 / 4.0;  // least variance of a pixel [gray levels^2]
constexpr int kWeights = 16;                 // sum of those of the filter
constexpr int kWeights2 = 36;                // of their squares
constexpr double kLensSigma = 0.9;           // px, of a point's image
constexpr int kFaintRounds = 3;
constexpr double kMaxShift = 1.5;  // px

/// The sum of weighted levels about a pixel.
int filtered(const GrayImage& image, int u, int v) {
  const auto across = [u](const std::uint8_t* row) { return row[u - 1] + 2 * row[u] + row[u + 1]; };
  return across(image.row(v - 1)) + 2 * across(image.row(v)) + across(image.row(v + 1));
}

/// Mean and sigma of the filter where the light is not.
struct LocalNoise {
  double mean = 0.0;
  double sigma = 0.0;
};

LocalNoise local_noise(const GrayImage& image, int u, int v) {
  double sum = 0.0;
  double squares = 0.0;
  int count = 0;
  for (int y = v - kOuter; y <= v + kOuter; y += kStep) {
    if (y < 1 || y >= image.height - 1) continue;
    for (int x = u - kOuter; x <= u + kOuter; x += kStep) {
      const bool is_light = std::abs(x - u) < kInner && std::abs(y - v) < kInner;
      if (is_light || x < 1 || x >= image.width - 1) continue;
      const double level = filtered(image, x, y);
      sum += level;
      squares += level * level;
      ++count;
    }
  }
  const double mean = sum / count;
  const double variance = (squares - count * mean * mean) / (count - 1);
  return {mean, std::sqrt(std::max(variance, kQuantization * kWeights2))};
}

struct Pixel {
  int u = 0;
  int v = 0;
};

/// Where `level(u, v)` is the highest, `reach` about the pixel.
template <class Level>
Pixel highest_near(Pixel middle, int reach, const Level& level) {
  Pixel best = middle;
  int most = level(middle.u, middle.v);
  for (int v = middle.v - reach; v <= middle.v + reach; ++v) {
    for (int u = middle.u - reach; u <= middle.u + reach; ++u) {
      const int here = level(u, v);
      if (here <= most) continue;
      most = here;
      best = {u, v};
    }
  }
  return best;
}

/// The fixed point of the centroid under a Gaussian window as wide as a point's image. The product
/// of both is narrower by the root of two, so a step is twice the centroid.
Eigen::Vector2d centroid(const GrayImage& image, int u, int v, double background) {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  for (int round = 0; round < kFaintRounds; ++round) {
    double weight = 0.0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int y = -kReach; y <= kReach; ++y) {
      for (int x = -kReach; x <= kReach; ++x) {
        const Eigen::Vector2d off = Eigen::Vector2d(x, y) - at;
        const double w = (image.row(v + y)[u + x] - background) *
                         std::exp(-0.5 * off.squaredNorm() / (kLensSigma * kLensSigma));
        weight += w;
        sum += w * off;
      }
    }
    if (weight <= 0.0) break;
    at += 2.0 / weight * sum;
    at = at.cwiseMax(-kMaxShift).cwiseMin(kMaxShift);
  }
  return at;
}

}  // namespace

std::optional<FaintLight> find_faint_light(const GrayImage& image, int u, int v,
                                           const FaintSearch& search) {
  const int margin = search.reach + kFaintMargin;
  if (u < margin || v < margin || u >= image.width - margin || v >= image.height - margin)
    return std::nullopt;
  const Pixel middle =
      highest_near({u, v}, search.reach, [&](int x, int y) { return filtered(image, x, y); });
  const int light = filtered(image, middle.u, middle.v);
  if (light < search.least_light) return std::nullopt;
  const LocalNoise noise = local_noise(image, middle.u, middle.v);
  FaintLight found;
  found.significance = (light - noise.mean) / noise.sigma;
  if (found.significance < search.significance) return std::nullopt;
  const double background = noise.mean / kWeights;
  const Pixel top = highest_near(middle, 1, [&](int x, int y) { return int{image.row(y)[x]}; });
  const double peak = image.row(top.v)[top.u] - background;
  const double flanks = filtered(image, top.u, top.v) - noise.mean - 4.0 * peak;
  found.is_hot = flanks < kLeastFlanks * std::sqrt(20.0 / kWeights2) * noise.sigma;
  const Eigen::Vector2d at = centroid(image, middle.u, middle.v, background);
  int area = 0;
  for (int y = top.v - 1; y <= top.v + 1; ++y) {
    for (int x = top.u - 1; x <= top.u + 1; ++x)
      area += image.row(y)[x] - background >= 0.5 * peak ? 1 : 0;
  }
  found.spot = {.u_px = middle.u + at.x(),
                .v_px = middle.v + at.y(),
                .area_px2 = static_cast<double>(std::max(2, area)),
                .peak = static_cast<double>(image.row(top.v)[top.u]),
                .elongation = 1.0};
  return found;
}

}  // namespace crepes
