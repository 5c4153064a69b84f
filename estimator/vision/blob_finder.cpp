#include "estimator/vision/blob_finder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace crepes {
namespace {

// Pixels that are looked at together, and within those that are not all alike.
constexpr int kBlock = 256;
constexpr int kPart = 64;
constexpr int kChunk = 16;
constexpr std::uint32_t kChunkBits = (1U << kChunk) - 1U;
constexpr std::size_t kUsualRuns = 1U << 12U;
constexpr std::size_t kMaxRuns = 1U << 15U;
constexpr std::size_t kMostFaintPeaks = 1U << 11U;

/// The extreme of kCount pixels by `pick`: a loop that GCC and Clang turn into vector instructions,
/// with nothing left over, since the first pixel is looked at twice.
template <int kCount, class Pick>
std::uint8_t extreme(const std::uint8_t* pixels, const Pick& pick) {
  std::uint8_t best = pixels[0];
  for (int i = 0; i < kCount; ++i) best = pick(best, pixels[i]);
  return best;
}

/// Whether no run begins or ends in these pixels.
template <int kCount>
bool is_uniform(const std::uint8_t* pixels, bool is_open, std::uint8_t threshold) {
  using Level = std::uint8_t;
  return is_open
             ? extreme<kCount>(pixels, [](Level a, Level b) { return a < b ? a : b; }) >= threshold
             : extreme<kCount>(pixels, [](Level a, Level b) { return a > b ? a : b; }) < threshold;
}

/// Of each pixel, from the lowest bit on, whether it is at or above the threshold.
std::uint32_t bright_ones(const std::uint8_t* pixels, std::uint8_t threshold) {
  std::uint32_t ones = 0;
  for (int i = 0; i < kChunk; ++i) ones |= (pixels[i] >= threshold ? 1U : 0U) << i;
  return ones;
}

/// Calls on_run(begin, end) for the runs of pixels at or above the threshold in [from, to).
template <class OnRun>
void scan(const std::uint8_t* row, int from, int to, std::uint8_t threshold, const OnRun& on_run) {
  bool is_open = false;
  int begin = from;
  const auto turn = [&](int u) {
    if (is_open) on_run(begin, u);
    begin = u;
    is_open = !is_open;
  };
  const auto search_part = [&](int first) {
    if (is_uniform<kPart>(row + first, is_open, threshold)) return;
    for (int chunk = first; chunk < first + kPart; chunk += kChunk) {
      const std::uint32_t ones = bright_ones(row + chunk, threshold);
      const std::uint32_t before = (ones << 1U) | (is_open ? 1U : 0U);
      std::uint32_t changes = (ones ^ before) & kChunkBits;
      for (; changes != 0; changes &= changes - 1) turn(chunk + std::countr_zero(changes));
    }
  };
  int u = from;
  for (; u + kBlock <= to; u += kBlock) {
    if (is_uniform<kBlock>(row + u, is_open, threshold)) continue;
    for (int part = u; part < u + kBlock; part += kPart) search_part(part);
  }
  for (; u + kPart <= to; u += kPart) search_part(u);
  for (; u < to; ++u)
    if ((row[u] >= threshold) != is_open) turn(u);
  if (is_open) on_run(begin, to);
}

/// Adds the pixels of a run. The weight is zero just below the threshold, so that pixels that come
/// and go there do not move the center.
void measure(const std::uint8_t* row, int v, int begin, int end, int threshold, Blob& blob) {
  std::int64_t weight = 0;
  std::int64_t sum_u = 0;
  for (int u = begin; u < end; ++u) {
    const std::int64_t w = row[u] - threshold + 1;
    weight += w;
    sum_u += w * u;
    blob.uu += w * u * u;
    blob.peak = std::max<int>(blob.peak, row[u]);
  }
  blob.weight += weight;
  blob.u += sum_u;
  blob.v += weight * v;
  blob.uv += sum_u * v;
  blob.vv += weight * v * v;
}

}  // namespace

bool PixelBox::overlaps(const PixelBox& other) const {
  return u_min <= other.u_max && other.u_min <= u_max && v_min <= other.v_max &&
         other.v_min <= v_max;
}

void PixelBox::include(const PixelBox& other) {
  u_min = std::min(u_min, other.u_min);
  v_min = std::min(v_min, other.v_min);
  u_max = std::max(u_max, other.u_max);
  v_max = std::max(v_max, other.v_max);
}

double Blob::elongation() const {
  constexpr double kPixel = 1.0 / 12.0;  // variance of a single pixel's own extent
  const auto w = static_cast<double>(weight);
  const double var_uu = static_cast<double>(uu) / w - mean_u() * mean_u() + kPixel;
  const double var_vv = static_cast<double>(vv) / w - mean_v() * mean_v() + kPixel;
  const double var_uv = static_cast<double>(uv) / w - mean_u() * mean_v();
  const double middle = 0.5 * (var_uu + var_vv);
  const double swing = std::hypot(0.5 * (var_uu - var_vv), var_uv);
  return std::sqrt((middle + swing) / std::max(middle - swing, kPixel));
}

void Blob::absorb(const Blob& part) {
  box.include(part.box);
  area += part.area;
  weight += part.weight;
  u += part.u;
  v += part.v;
  uu += part.uu;
  uv += part.uv;
  vv += part.vv;
  peak = std::max(peak, part.peak);
}

BlobFinder::BlobFinder() {
  runs_.reserve(kUsualRuns);
  blob_of_.reserve(kUsualRuns);
  faint_.reserve(kMostFaintPeaks + kUsualRuns);
}

bool BlobFinder::find(const GrayImage& image, Levels levels, std::span<const MendedPixel> mended,
                      double max_area, std::vector<Blob>& blobs) {
  runs_.clear();
  faint_.clear();
  mended_ = mended;
  for (int v = 0; v < image.height; ++v) {
    find_runs(image, v, levels);
    if (runs_.size() > kMaxRuns) return false;
    if (faint_.size() <= kMostFaintPeaks) continue;
    faint_.clear();
    levels.faint = levels.threshold;
  }
  link_rows();
  const std::size_t first = blobs.size();
  outline(blobs);
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    Blob& blob = blobs[first + blob_of_[i]];
    if (blob.area <= max_area)
      measure(image.row(run.row), run.row, run.begin, run.end, levels.threshold, blob);
  }
  return true;
}

std::optional<std::size_t> BlobFinder::blob_at(int u, int v) const {
  const auto after = std::partition_point(runs_.begin(), runs_.end(), [&](const Run& run) {
    return run.row < v || (run.row == v && run.begin <= u);
  });
  if (after == runs_.begin()) return std::nullopt;
  const auto run = after - 1;
  if (run->row != v || u >= run->end) return std::nullopt;
  return blob_of_[static_cast<std::size_t>(run - runs_.begin())];
}

void BlobFinder::find_runs(const GrayImage& image, int v, Levels levels) {
  const std::uint8_t* const row = image.row(v);
  const auto threshold = static_cast<std::uint8_t>(levels.threshold);
  const auto add = [&](int begin, int end) { add_run(v, begin, end, levels.threshold); };
  if (levels.faint >= levels.threshold) {
    scan(row, 0, image.width, threshold, add);
    return;
  }
  scan(row, 0, image.width, static_cast<std::uint8_t>(levels.faint), [&](int begin, int end) {
    const std::size_t before = runs_.size();
    scan(row, begin, end, threshold, add);
    if (runs_.size() == before) find_peak(image, v, begin, end);
  });
}

/// Keeps the brightest pixel of the run, unless it has a brighter neighbor in the next rows.
void BlobFinder::find_peak(const GrayImage& image, int v, int begin, int end) {
  const std::uint8_t* const row = image.row(v);
  const auto u = static_cast<int>(std::max_element(row + begin, row + end) - row);
  for (const int y : {v - 1, v + 1}) {
    if (y < 0 || y >= image.height) continue;
    for (int x = std::max(0, u - 1); x <= std::min(image.width - 1, u + 1); ++x)
      if (image.row(y)[x] > row[u]) return;
  }
  faint_.push_back({u, v});
}

/// Adds the run without mended pixels that are not that bright.
void BlobFinder::add_run(int v, int begin, int end, int threshold) {
  const auto is_before = [v](int u, const MendedPixel& p) {
    return p.v < v || (p.v == v && p.u < u);
  };
  const auto add = [&](int from, int to) {
    if (from < to) runs_.push_back({v, from, to, static_cast<std::uint32_t>(runs_.size())});
  };
  while (!mended_.empty() && is_before(begin, mended_.front())) mended_ = mended_.subspan(1);
  while (!mended_.empty() && is_before(end, mended_.front())) {
    const MendedPixel& pixel = mended_.front();
    mended_ = mended_.subspan(1);
    if (pixel.level >= threshold) continue;
    add(begin, pixel.u);
    begin = pixel.u + 1;
  }
  add(begin, end);
}

std::uint32_t BlobFinder::root_of(std::uint32_t run) {
  while (runs_[run].parent != run) run = runs_[run].parent = runs_[runs_[run].parent].parent;
  return run;
}

/// Joins runs of adjacent rows that touch, corners included.
void BlobFinder::link_rows() {
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

/// Appends a blob for each root, with its box and area.
void BlobFinder::outline(std::vector<Blob>& blobs) {
  const std::size_t first = blobs.size();
  blob_of_.assign(runs_.size(), 0);
  for (std::uint32_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    const PixelBox box{run.begin, run.row, run.end - 1, run.row};
    const std::uint32_t root = root_of(i);
    if (root == i) {
      blob_of_[i] = static_cast<std::uint32_t>(blobs.size() - first);
      blobs.push_back({.box = box});
    }
    blob_of_[i] = blob_of_[root];
    Blob& blob = blobs[first + blob_of_[i]];
    blob.box.include(box);
    blob.area += run.end - run.begin;
  }
}

}  // namespace crepes
