#include "estimator/vision/hot_pixel_map.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr int kDarkPenalty = 100;  // pictures; a board is dark in more than one of a hundred
constexpr int kMostScore = HotPixelMap::kKnown + 2 * kDarkPenalty - 1;
constexpr std::size_t kMaxNew = 64;  // a picture

/// The mean of the middle two of the four neighbors.
std::uint8_t median_around(const GrayImage& image, int u, int v) {
  const int left = image.row(v)[std::max(0, u - 1)];
  const int right = image.row(v)[std::min(image.width - 1, u + 1)];
  const int above = image.row(std::max(0, v - 1))[u];
  const int below = image.row(std::min(image.height - 1, v + 1))[u];
  const auto [least, most] = std::minmax({left, right, above, below});
  return static_cast<std::uint8_t>((left + right + above + below - least - most) / 2);
}

}  // namespace

HotPixelMap::HotPixelMap() {
  suspects_.reserve(kMaxSuspects);
  known_.reserve(kMaxSuspects);
  new_.reserve(kMaxNew);
}

bool HotPixelMap::is_before(const Suspect& a, const Suspect& b) {
  return a.v != b.v ? a.v < b.v : a.u < b.u;
}

void HotPixelMap::add_frame(const GrayImage& image, int level) {
  if (image.width != width_ || image.height != height_) {
    suspects_.clear();
    new_.clear();
    width_ = image.width;
    height_ = image.height;
  }
  admit();
  known_.clear();
  std::erase_if(suspects_, [&](Suspect& suspect) {
    const bool is_lit = image.row(suspect.v)[suspect.u] >= level;
    suspect.score = is_lit ? std::min(suspect.score + 1, kMostScore) : suspect.score - kDarkPenalty;
    if (suspect.score >= kKnown)
      known_.push_back({suspect.u, suspect.v, median_around(image, suspect.u, suspect.v)});
    return suspect.score <= 0;
  });
}

bool HotPixelMap::has_room() const {
  return new_.size() < kMaxNew && suspects_.size() + new_.size() < kMaxSuspects;
}

void HotPixelMap::suspect(int u, int v) {
  if (!has_room()) return;
  const Suspect suspect{u, v, 1};
  if (!std::binary_search(suspects_.begin(), suspects_.end(), suspect, is_before))
    new_.push_back(suspect);
}

void HotPixelMap::admit() {
  if (new_.empty()) return;
  std::sort(new_.begin(), new_.end(), is_before);
  const auto is_same = [](const Suspect& a, const Suspect& b) { return a.u == b.u && a.v == b.v; };
  new_.erase(std::unique(new_.begin(), new_.end(), is_same), new_.end());
  // Merged from the end, in place.
  std::size_t old_count = suspects_.size();
  std::size_t new_count = new_.size();
  suspects_.resize(old_count + new_count);
  while (new_count > 0) {
    Suspect& last = suspects_[old_count + new_count - 1];
    const bool is_old = old_count > 0 && is_before(new_[new_count - 1], suspects_[old_count - 1]);
    last = is_old ? suspects_[--old_count] : new_[--new_count];
  }
  new_.clear();
}

std::span<const MendedPixel> HotPixelMap::in_rows_of(const PixelBox& box) const {
  const auto first = std::partition_point(
      known_.begin(), known_.end(), [&](const MendedPixel& pixel) { return pixel.v < box.v_min; });
  const auto end = std::partition_point(
      first, known_.end(), [&](const MendedPixel& pixel) { return pixel.v <= box.v_max; });
  return {first, end};
}

bool HotPixelMap::is_in(const PixelBox& box) const {
  const auto rows = in_rows_of(box);
  return std::any_of(rows.begin(), rows.end(), [&](const MendedPixel& pixel) {
    return box.u_min <= pixel.u && pixel.u <= box.u_max;
  });
}

}  // namespace crepes
