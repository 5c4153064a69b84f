/// Pieces of boards that are far away, put together.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimator/vision/blob_finder.hpp"

namespace crepes {

/// A board some meters away shows a few pieces with dark pixels between them. Pieces that make up
/// something as round as a board become one blob, at the place of the first.
class FragmentJoiner {
 public:
  /// Nothing is allocated for less than 1024 blobs.
  FragmentJoiner();

  /// `open` are indices of blobs, by first row. The first of a group becomes its sum; the others
  /// are no longer open.
  void join(std::span<const std::uint32_t> open, std::span<Blob> blobs,
            std::span<std::uint8_t> is_open);

 private:
  void link(std::span<const std::uint32_t> open, std::span<const Blob> blobs);
  [[nodiscard]] std::uint32_t root_of(std::uint32_t place);

  std::vector<std::uint32_t> parent_;  ///< union-find over places in `open`
  std::vector<Blob> groups_;           ///< sums over its sets, at the first place of each
};

}  // namespace crepes
