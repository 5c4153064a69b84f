/// Groups the separate LEDs of a near board into one detection.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/vision/blob_finder.hpp"
#include "estimator/vision/ring_model.hpp"

namespace crepes {

/// What may be a single LED.
struct Light {
  double u = 0.0, v = 0.0;  ///< center [px]
  std::int32_t area = 0;    ///< [px^2]
  int peak = 0;             ///< gray level
  std::uint32_t blob = 0;   ///< the blob that it is, or is part of
};

/// A board whose LEDs are separate lights.
struct Ring {
  RingView view{};
  int leds = 0;  ///< of the board; some may be hidden
  std::array<std::uint32_t, kMaxRingLeds> lights{};
  std::size_t count = 0;  ///< of lights
  double rms = 0.0;       ///< [px]

  [[nodiscard]] bool is_whole() const { return count == static_cast<std::size_t>(leds); }
  [[nodiscard]] std::span<const std::uint32_t> members() const {
    return std::span(lights).first(count);
  }
};

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
  struct Link {
    double length;
    std::uint32_t a, b;
  };
  static constexpr std::size_t kNearest = 3;
  using Members = std::array<std::uint32_t, kMaxRingLeds + 1>;

  void link_neighbors();
  void grow_from(std::uint32_t b);
  void grow_row(const std::array<std::uint32_t, 4>& row);
  template <class Judge>
  void join_all(const Judge& judge);
  void judge_whole(std::span<const std::uint32_t> group);
  void judge_part(std::span<const std::uint32_t> group);
  [[nodiscard]] std::optional<Ring> whole_ring(std::span<const std::uint32_t> members) const;
  [[nodiscard]] std::optional<Ring> arc(std::span<const std::uint32_t> members) const;
  [[nodiscard]] std::optional<Ring> arc_after(std::span<const std::uint32_t> members,
                                              std::size_t first) const;
  [[nodiscard]] bool complete(Ring& ring, const RingShape& shape, std::size_t shift) const;
  [[nodiscard]] std::optional<Ring> half_ring(std::span<const std::uint32_t> members) const;
  [[nodiscard]] bool are_alike(std::span<const std::uint32_t> members, double factor) const;
  /// Whether they are as bright as LEDs at this distance.
  [[nodiscard]] bool are_leds(std::span<const std::uint32_t> members) const;
  [[nodiscard]] bool is_lit(const Eigen::Vector2d& uv) const;
  [[nodiscard]] bool is_alone(const Ring& ring) const;
  [[nodiscard]] bool is_credible(const Ring& ring) const;
  void accept();

  std::span<const Light> lights_;
  const GrayImage* image_ = nullptr;
  int threshold_ = 0;
  std::vector<RingShape> shapes_;     ///< by number of LEDs
  std::vector<std::uint32_t> order_;  ///< lights by u
  std::vector<Link> links_;
  std::vector<std::array<std::uint32_t, kNearest>> near_;  ///< of each light; itself for none
  std::vector<std::uint32_t> parent_;                      ///< union-find over lights
  std::vector<std::uint32_t> next_;                        ///< the groups as cycles
  std::vector<std::uint32_t> size_;                        ///< of the group, at its root
  std::vector<Ring> candidates_;
  std::vector<std::uint8_t> is_taken_;
  std::vector<Ring> rings_;
};

}  // namespace crepes
