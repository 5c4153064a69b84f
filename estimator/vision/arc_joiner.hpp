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

/// Blobs on one ellipse.
struct JoinedArcs {
  RingView view{};
  std::array<std::uint32_t, kMaxRingLeds> blobs{};
  std::size_t count = 0;  ///< of blobs

  [[nodiscard]] std::span<const std::uint32_t> members() const {
    return std::span(blobs).first(count);
  }
};

/// Joins the blobs of a ring that is seen aslant, or has many LEDs: where its LEDs touch they are
/// arcs, which have no center of an LED to offer, but all of their pixels are near one ellipse.
///
/// It takes a single LED, which tells how wide an arc is, and an arc; or arcs only, whose width is
/// their area by the length that they cover. Light has to be on most of the ellipse, and darkness
/// within.
class ArcJoiner {
 public:
  ArcJoiner();

  /// Valid until the next call. `open` are places in `blobs`, which `finder` found, by first row.
  [[nodiscard]] std::span<const JoinedArcs> join(std::span<const Blob> blobs,
                                                 std::span<const std::uint32_t> open,
                                                 const BlobFinder& finder);

 private:
  [[nodiscard]] bool gather(std::uint32_t arc, std::span<const Blob> blobs,
                            std::span<const std::uint32_t> open);
  [[nodiscard]] bool is_ring(std::span<const Blob> blobs, const BlobFinder& finder);

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
