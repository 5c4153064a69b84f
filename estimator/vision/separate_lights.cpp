#include "estimator/vision/separate_lights.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "estimator/vision/brightness_sample.hpp"

namespace crepes {
namespace {

constexpr int kLeastRise = 12;           // gray levels above the saddle to the next light
constexpr double kContrastShare = 0.15;  // of the light's own height above the background
constexpr double kCenterLevel = 0.3;     // of its height: what is below does not move its center
constexpr std::size_t kMostLights = 300;
constexpr std::int32_t kNoRegion = -1;

/// A light: its brightest pixel, and the gray level at which it meets another or the background.
struct Summit {
  std::int32_t pixel = 0;
  int peak = 0;
  int floor = 0;
};

/// Floods the picture from the brightest pixels down. Regions that meet are one from there on; each
/// that rises far enough above the meeting point is a light of its own.
class SummitFinder {
 public:
  SummitFinder(const GrayImage& image, const Background& background)
      : image_(image),
        background_(background),
        parent_(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
                kNoRegion) {}

  [[nodiscard]] std::vector<Summit> find() && {
    std::array<std::vector<std::int32_t>, 256> levels;
    for (int v = 0; v < image_.height; ++v)
      for (int u = 0; u < image_.width; ++u)
        if (const int gray = image_.row(v)[u]; gray >= background_.threshold)
          levels.at(static_cast<std::size_t>(gray)).push_back(v * image_.width + u);
    for (int gray = 255; gray >= background_.threshold; --gray)
      for (const std::int32_t pixel : levels.at(static_cast<std::size_t>(gray))) add(pixel, gray);
    for (std::size_t i = 0; i < regions_.size(); ++i)
      if (regions_[i].is_root) close(regions_[i], background_.median);
    return std::move(found_);
  }

 private:
  struct Region {
    Summit summit;
    bool is_root = true;
    bool is_closed = false;  ///< its lights are found
  };

  void add(std::int32_t pixel, int gray) {
    const auto own = static_cast<std::int32_t>(regions_.size());
    regions_.push_back({.summit = {pixel, gray, 0}});
    region_parent_.push_back(own);
    parent_[static_cast<std::size_t>(pixel)] = own;
    const int u = pixel % image_.width;
    const int v = pixel / image_.width;
    for (int y = std::max(0, v - 1); y <= std::min(image_.height - 1, v + 1); ++y)
      for (int x = std::max(0, u - 1); x <= std::min(image_.width - 1, u + 1); ++x)
        if (const std::int32_t other = parent_[static_cast<std::size_t>(y * image_.width + x)];
            other != kNoRegion)
          join(root_of(own), root_of(other), gray);
  }

  [[nodiscard]] std::int32_t root_of(std::int32_t region) {
    while (region_parent_[static_cast<std::size_t>(region)] != region) {
      auto& up = region_parent_[static_cast<std::size_t>(region)];
      up = region_parent_[static_cast<std::size_t>(up)];
      region = up;
    }
    return region;
  }

  [[nodiscard]] bool stands_out(const Region& region, int floor) const {
    const int height = region.summit.peak - background_.median;
    return region.summit.peak - floor >= std::max<double>(kLeastRise, kContrastShare * height);
  }

  void close(Region& region, int floor) {
    if (region.is_closed || !stands_out(region, floor)) return;
    region.summit.floor = floor;
    region.is_closed = true;
    found_.push_back(region.summit);
  }

  void join(std::int32_t a, std::int32_t b, int gray) {
    if (a == b) return;
    Region* high = &regions_[static_cast<std::size_t>(a)];
    Region* low = &regions_[static_cast<std::size_t>(b)];
    if (high->summit.peak < low->summit.peak) {
      std::swap(high, low);
      std::swap(a, b);
    }
    // Two lights meet; or a bump on the flank of one, which is no light.
    if (low->is_closed || stands_out(*low, gray)) {
      close(*low, gray);
      close(*high, gray);
      high->is_closed = true;
    }
    low->is_root = false;
    region_parent_[static_cast<std::size_t>(b)] = a;
  }

  const GrayImage& image_;
  const Background& background_;
  std::vector<std::int32_t> parent_;  ///< of each pixel: its region
  std::vector<std::int32_t> region_parent_;
  std::vector<Region> regions_;
  std::vector<Summit> found_;
};

/// The center of what is connected to the summit above its floor, weighted by the height above it.
/// Empty at the border of the picture. `seen` holds the summit up to which a pixel was visited.
class CenterFinder {
 public:
  CenterFinder(const GrayImage& image, int background)
      : image_(image),
        background_(background),
        seen_(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height), 0) {}

  [[nodiscard]] std::optional<Spot> spot(const Summit& summit) {
    ++round_;
    const double level =
        std::max<double>(summit.floor, background_ + kCenterLevel * (summit.peak - background_));
    double sum = 0.0;
    double sum_u = 0.0;
    double sum_v = 0.0;
    double area = 0.0;
    open_.assign(1, summit.pixel);
    seen_[static_cast<std::size_t>(summit.pixel)] = round_;
    while (!open_.empty()) {
      const int u = open_.back() % image_.width;
      const int v = open_.back() / image_.width;
      open_.pop_back();
      if (u == 0 || v == 0 || u == image_.width - 1 || v == image_.height - 1) return std::nullopt;
      const double weight = image_.row(v)[u] - level;
      sum += weight;
      sum_u += weight * u;
      sum_v += weight * v;
      area += 1.0;
      for (int y = v - 1; y <= v + 1; ++y)
        for (int x = u - 1; x <= u + 1; ++x) visit(x, y, level);
    }
    return Spot{.u_px = sum_u / sum,
                .v_px = sum_v / sum,
                .area_px2 = area,
                .peak = static_cast<double>(summit.peak)};
  }

 private:
  void visit(int u, int v, double level) {
    const auto pixel = static_cast<std::size_t>(v * image_.width + u);
    if (seen_[pixel] == round_ || image_.row(v)[u] <= level) return;
    seen_[pixel] = round_;
    open_.push_back(static_cast<std::int32_t>(pixel));
  }

  const GrayImage& image_;
  int background_;
  std::uint32_t round_ = 0;
  std::vector<std::uint32_t> seen_;
  std::vector<std::int32_t> open_;
};

}  // namespace

std::vector<Spot> separate_lights(const GrayImage& image) {
  const Background background = BrightnessSample(image).darkest_from(0);
  std::vector<Summit> summits = SummitFinder(image, background).find();
  std::ranges::stable_sort(summits, std::ranges::greater{},
                           [](const Summit& s) { return s.peak - s.floor; });
  if (summits.size() > kMostLights) summits.resize(kMostLights);
  CenterFinder centers(image, background.median);
  std::vector<Spot> spots;
  for (const Summit& summit : summits)
    if (const auto spot = centers.spot(summit)) spots.push_back(*spot);
  return spots;
}

}  // namespace crepes
