/// Groups the separate LEDs of a near board into one detection.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimator/vision/blob_finder.hpp"
#include "estimator/vision/rings/light_field.hpp"
#include "estimator/vision/rings/light_groups.hpp"
#include "estimator/vision/rings/ring.hpp"
#include "estimator/vision/rings/ring_fitter.hpp"

namespace crepes {

/// Finds boards so near that their LEDs are lights of their own: rings of 4 to 16 LEDs, round or
/// square, seen up to 73 degrees aslant, whole or in part.
///
/// Single-linkage clustering joins the lights, the nearest first, into a tree of groups. All LEDs
/// of a ring are one group of this tree. If another light is too near, only arcs of the ring are
/// groups. Each group is compared with every shape that has as many LEDs. As an arc, it is also
/// compared with shapes of more LEDs: an arc predicts where the other LEDs are. They are added
/// where there is light; where there is none, the picture must be dark. Whole rings are accepted
/// before arcs, and rings of many lights before rings of few. The remaining rings have other lights
/// too near: they are predicted from four LEDs in a row.
///
/// Few lights are weak evidence. Four lights are accepted, as a ring or as an arc of more LEDs,
/// only if they are alike and alone. Three lights are accepted only as half of a ring of six: if
/// they are parts of one blob, or bright and closer together than robots fly.
class RingFinder {
 public:
  RingFinder();

  /// Valid until the next call. A light belongs to one ring at most. The lights are those of
  /// `image` above `threshold`.
  [[nodiscard]] std::span<const Ring> find(std::span<const Light> lights, const GrayImage& image,
                                           int threshold);

 private:
  void join_whole();
  void join_parts();
  void judge_whole(std::span<const std::uint32_t> group);
  void judge_part(std::span<const std::uint32_t> group);
  void grow_from(std::uint32_t b);
  [[nodiscard]] bool is_alone(const Ring& ring) const;
  [[nodiscard]] bool is_credible(const Ring& ring) const;
  void accept();

  LightField field_;
  LightGroups groups_;
  RingFitter fitter_;
  std::vector<Ring> candidates_;
  std::vector<std::uint8_t> is_taken_;  ///< by light
  std::vector<Ring> rings_;
};

}  // namespace crepes
