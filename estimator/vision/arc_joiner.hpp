/// Boards of which some LEDs touch and others do not.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/vision/blob_finder.hpp"
#include "estimator/vision/ring_model.hpp"

namespace crepes {

/// Blobs on one ellipse, or on the outline of a square.
struct JoinedArcs {
  RingView view{};
  std::array<std::uint32_t, kMaxRingLeds> blobs{};
  std::size_t count = 0;  ///< of blobs

  [[nodiscard]] std::span<const std::uint32_t> members() const {
    return std::span(blobs).first(count);
  }
};

/// Joins the blobs of a ring that is seen at a slant or has many LEDs. Where LEDs touch, they
/// appear as arcs. An arc shows no centers of LEDs, but all of its pixels are near one ellipse.
///
/// A ring needs a single LED, which shows how wide an arc is, and at least one arc; or arcs only,
/// whose width is their area divided by the length that they cover. Most of the ellipse must be
/// lit, and its inside dark. What lies on no ellipse may lie on a parallelogram: a square board
/// whose LEDs touch along two edges. It needs a single LED.
class ArcJoiner {
 public:
  ArcJoiner();

  /// Squares with an edge along which LEDs touch: no other board looks like that, while the single
  /// LEDs among them may look like parts of one. Valid until the next call. `open` are places in
  /// `blobs`, which `finder` found, by first row.
  [[nodiscard]] std::span<const JoinedArcs> join_squares(std::span<const Blob> blobs,
                                                         std::span<const std::uint32_t> open,
                                                         const BlobFinder& finder);
  /// The same for all others.
  [[nodiscard]] std::span<const JoinedArcs> join(std::span<const Blob> blobs,
                                                 std::span<const std::uint32_t> open,
                                                 const BlobFinder& finder);

 private:
  template <class IsBoard>
  [[nodiscard]] std::span<const JoinedArcs> join_where(std::span<const std::uint32_t> open,
                                                       std::size_t blobs, const IsBoard& is_board);
  [[nodiscard]] bool gather(std::uint32_t arc, std::span<const Blob> blobs,
                            std::span<const std::uint32_t> open);
  [[nodiscard]] bool is_ring(std::span<const Blob> blobs, const BlobFinder& finder);
  [[nodiscard]] bool is_square(std::span<const Blob> blobs, const BlobFinder& finder);

  JoinedArcs ring_;
  bool has_led_ = false;  ///< a member that may be a single LED
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<std::uint8_t> is_taken_;  ///< by blob
  std::vector<JoinedArcs> rings_;
};

/// The ellipse nearest to the points, as the view of a round ring from afar. Nothing where they are
/// on no ellipse.
[[nodiscard]] std::optional<RingView> fit_ellipse(std::span<const Eigen::Vector2d> points);

}  // namespace crepes
