#include "estimator/vision/rings/fragment_joiner.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr std::size_t kUsualFragments = 1024;
constexpr int kMaxFragmentGap = 3;       // px between the LEDs of one board that is far away
constexpr double kMaxElongation = 2.45;  // of a board in fragments; two side by side are longer
constexpr int kMaxSpeck = 7;        // px; pieces of so little are one board, whatever its shape
constexpr int kMaxFragmented = 28;  // px; on a larger board every LED stands alone

}  // namespace

FragmentJoiner::FragmentJoiner() {
  parent_.reserve(kUsualFragments);
  groups_.reserve(kUsualFragments);
}

std::uint32_t FragmentJoiner::root_of(std::uint32_t place) {
  while (parent_[place] != place) place = parent_[place] = parent_[parent_[place]];
  return place;
}

void FragmentJoiner::link(std::span<const std::uint32_t> open, std::span<const Blob> blobs) {
  const auto count = static_cast<std::uint32_t>(open.size());
  parent_.resize(count);
  for (std::uint32_t a = 0; a < count; ++a) parent_[a] = a;
  for (std::uint32_t a = 0; a < count; ++a) {
    const PixelBox near = blobs[open[a]].box.grown(kMaxFragmentGap + 1);
    for (std::uint32_t b = a + 1; b < count && blobs[open[b]].box.v_min <= near.v_max; ++b) {
      if (!near.overlaps(blobs[open[b]].box)) continue;
      const std::uint32_t x = root_of(a);
      const std::uint32_t y = root_of(b);
      parent_[std::max(x, y)] = std::min(x, y);
    }
  }
}

void FragmentJoiner::join(std::span<const std::uint32_t> open, std::span<Blob> blobs,
                          std::span<std::uint8_t> is_open) {
  link(open, blobs);
  const auto count = static_cast<std::uint32_t>(open.size());
  groups_.resize(count);
  for (std::uint32_t a = 0; a < count; ++a) {
    const std::uint32_t root = root_of(a);  // comes before the others of its group
    if (root == a) {
      groups_[a] = blobs[open[a]];
    } else {
      groups_[root].absorb(blobs[open[a]]);
    }
  }
  for (std::uint32_t a = 0; a < count; ++a) {
    const std::uint32_t root = root_of(a);
    const Blob& group = groups_[root];
    const int side = group.box.longer_side();
    if (side > kMaxFragmented || (side > kMaxSpeck && group.elongation() > kMaxElongation))
      continue;
    if (root == a) {
      blobs[open[a]] = group;
    } else {
      is_open[open[a]] = 0;
    }
  }
}

}  // namespace crepes
