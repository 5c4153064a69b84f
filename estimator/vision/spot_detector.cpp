#include "estimator/vision/spot_detector.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr int kMaxSide = 2048;
constexpr int kBlock = 256;  // pixels that are skipped at once
constexpr int kPart = 64;    // and within a block that is not
constexpr std::size_t kMaxRuns = 1U << 16U;
constexpr int kMinContrast = 24;       // gray levels above the background
constexpr double kSpreadSigmas = 8.0;  // noise above the background
constexpr int kMaxGap = 3;             // px between the LEDs of one board that is far away

/// The highest of kCount pixels, a multiple of 16, in code that compilers turn into vector
/// instructions.
template <int kCount>
std::uint8_t highest(const std::uint8_t* pixels) {
  std::array<std::uint8_t, 16> best{};
  for (int i = 0; i < kCount; i += 16) {
    for (int k = 0; k < 16; ++k) {
      const auto at = static_cast<std::size_t>(k);
      best[at] = std::max(best[at], pixels[i + k]);
    }
  }
  std::uint8_t top = 0;
  for (const std::uint8_t b : best) top = std::max(top, b);
  return top;
}

double elongation_of(const Blob& blob) {
  const auto w = static_cast<double>(blob.weight);
  const double mean_u = static_cast<double>(blob.u) / w;
  const double mean_v = static_cast<double>(blob.v) / w;
  constexpr double kPixel = 1.0 / 12.0;  // variance of a single pixel's own extent
  const double uu = static_cast<double>(blob.uu) / w - mean_u * mean_u + kPixel;
  const double vv = static_cast<double>(blob.vv) / w - mean_v * mean_v + kPixel;
  const double uv = static_cast<double>(blob.uv) / w - mean_u * mean_v;
  const double middle = 0.5 * (uu + vv);
  const double swing = std::hypot(0.5 * (uu - vv), uv);
  return std::sqrt((middle + swing) / std::max(middle - swing, kPixel));
}

}  // namespace

int automatic_threshold(const GrayImage& image) {
  std::array<int, 256> histogram{};
  int count = 0;
  const int row_step = std::max(1, image.height / 32);
  for (int v = row_step / 2; v < image.height; v += row_step) {
    for (int u = 0; u < image.width; u += 4) {
      ++histogram[image.pixels[v * image.stride + u]];
      ++count;
    }
  }
  const auto quantile = [&](double part) {
    int below = 0;
    int level = 0;
    while (level < 255 && below + histogram[static_cast<std::size_t>(level)] <= part * count)
      below += histogram[static_cast<std::size_t>(level++)];
    return level;
  };
  const int median = quantile(0.5);
  const double sigma = (quantile(0.841) - quantile(0.159)) / 2.0;
  const int contrast = std::max(kMinContrast, static_cast<int>(std::ceil(kSpreadSigmas * sigma)));
  return std::min(median + contrast, 250);
}

Detection SpotDetector::detect(const GrayImage& image) {
  CREPES_EXPECT(image.pixels != nullptr && image.width > 0 && image.height > 0 &&
                    image.width <= kMaxSide && image.height <= kMaxSide &&
                    image.stride >= image.width,
                "an image of 1 to 2048 pixels a side");
  threshold_ = config_.threshold > 0 ? config_.threshold : automatic_threshold(image);
  spots_.clear();
  blobs_.clear();
  if (config_.detector == SpotDetectorKind::kHough) {
    find_circles(image, threshold_, config_, spots_);
    return {spots_, threshold_, spots_.empty() ? Exposure::kDark : Exposure::kGood};
  }
  if (!scan(image)) return {{}, threshold_, Exposure::kBright};
  link_rows();
  measure(image);
  rings_.join(blobs_);
  join_fragments();
  select();
  return {spots_, threshold_, runs_.empty() ? Exposure::kDark : Exposure::kGood};
}

/// False when there is too much light to bother.
bool SpotDetector::scan(const GrayImage& image) {
  runs_.clear();
  runs_.reserve(4096);
  std::int64_t lit = 0;
  const std::int64_t most = static_cast<std::int64_t>(image.width) * image.height / 4;
  for (int v = 0; v < image.height; ++v) {
    const std::size_t before = runs_.size();
    find_runs(image.pixels + v * image.stride, v, image.width);
    for (std::size_t i = before; i < runs_.size(); ++i) lit += runs_[i].end - runs_[i].begin;
    if (lit > most || runs_.size() > kMaxRuns) return false;
  }
  return true;
}

void SpotDetector::find_runs(const std::uint8_t* row, int v, int width) {
  const auto threshold = static_cast<std::uint8_t>(threshold_);
  bool is_open = false;
  const auto visit = [&](int u) {
    if ((row[u] >= threshold) == is_open) return;
    if (!is_open) {
      runs_.push_back({v, u, width, static_cast<std::uint32_t>(runs_.size())});
    } else {
      runs_.back().end = u;
    }
    is_open = !is_open;
  };
  int u = 0;
  for (; u + kBlock <= width; u += kBlock) {
    if (is_open || highest<kBlock>(row + u) >= threshold) {
      for (int part = u; part < u + kBlock; part += kPart) {
        if (is_open || highest<kPart>(row + part) >= threshold)
          for (int i = part; i < part + kPart; ++i) visit(i);
      }
    }
  }
  for (; u < width; ++u) visit(u);
}

std::uint32_t SpotDetector::root_of(std::uint32_t run) {
  while (runs_[run].parent != run) run = runs_[run].parent = runs_[runs_[run].parent].parent;
  return run;
}

/// Joins runs of adjacent rows that touch, corners included.
void SpotDetector::link_rows() {
  std::size_t above = 0;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    while (runs_[above].row < run.row - 1 ||
           (runs_[above].row == run.row - 1 && runs_[above].end < run.begin))
      ++above;
    for (std::size_t j = above; j < i && runs_[j].row == run.row - 1 && runs_[j].begin <= run.end;
         ++j) {
      const std::uint32_t a = root_of(static_cast<std::uint32_t>(j));
      const std::uint32_t b = root_of(static_cast<std::uint32_t>(i));
      runs_[std::max(a, b)].parent = std::min(a, b);
    }
  }
}

void SpotDetector::measure(const GrayImage& image) {
  blob_of_.assign(runs_.size(), 0);
  for (std::uint32_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    const std::uint32_t root = root_of(i);
    if (root == i) {
      blob_of_[i] = static_cast<std::uint32_t>(blobs_.size());
      blobs_.push_back(
          {.u_min = run.begin, .u_max = run.end - 1, .v_min = run.row, .v_max = run.row});
    }
    Blob& blob = blobs_[blob_of_[root]];
    const std::uint8_t* row = image.pixels + run.row * image.stride;
    std::int64_t weight = 0;
    std::int64_t sum_u = 0;
    for (int u = run.begin; u < run.end; ++u) {
      // Zero at the threshold, so that pixels that come and go there do not move the center.
      const int w = row[u] - threshold_ + 1;
      weight += w;
      sum_u += static_cast<std::int64_t>(w) * u;
      blob.uu += static_cast<std::int64_t>(w) * u * u;
      blob.peak = std::max<int>(blob.peak, row[u]);
    }
    blob.weight += weight;
    blob.u += sum_u;
    blob.v += weight * run.row;
    blob.uv += sum_u * run.row;
    blob.vv += weight * run.row * run.row;
    blob.area += run.end - run.begin;
    blob.u_min = std::min(blob.u_min, run.begin);
    blob.u_max = std::max(blob.u_max, run.end - 1);
    blob.v_max = run.row;
  }
}

/// A board some meters away: LEDs a few dark pixels apart. Blobs come ordered by their first row.
void SpotDetector::join_fragments() {
  constexpr std::size_t kMaxFragments = 4096;
  if (blobs_.size() > kMaxFragments) return;
  bool has_changed = true;
  for (int round = 0; has_changed && round < 6; ++round) {
    has_changed = false;
    for (std::size_t i = 0; i < blobs_.size(); ++i) {
      if (blobs_[i].is_part) continue;
      for (std::size_t j = i + 1;
           j < blobs_.size() && blobs_[j].v_min <= blobs_[i].v_max + kMaxGap + 1; ++j) {
        Blob& a = blobs_[i];
        Blob& b = blobs_[j];
        if (b.is_part || b.u_min > a.u_max + kMaxGap + 1 || a.u_min > b.u_max + kMaxGap + 1)
          continue;
        absorb(a, b);
        has_changed = true;
      }
    }
  }
}

void SpotDetector::select() {
  for (const Blob& blob : blobs_) {
    if (blob.is_part || blob.area < config_.min_area_px2 || blob.area > config_.max_area_px2)
      continue;
    spots_.push_back({.u_px = blob.mean_u(),
                      .v_px = blob.mean_v(),
                      .area_px2 = static_cast<double>(blob.area),
                      .peak = static_cast<double>(blob.peak),
                      .elongation = elongation_of(blob)});
  }
  std::sort(spots_.begin(), spots_.end(),
            [](const Spot& a, const Spot& b) { return a.peak * a.area_px2 > b.peak * b.area_px2; });
  const auto most = static_cast<std::size_t>(config_.max_spots);
  if (spots_.size() > most) spots_.resize(most);
}

}  // namespace crepes
