/// Six LEDs to one board.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace crepes {

/// What may be a single LED.
struct Light {
  double u = 0.0, v = 0.0;  ///< center [px]
  std::int32_t area = 0;    ///< [px^2]
  int peak = 0;             ///< gray level
  std::uint32_t blob = 0;   ///< the blob that it is, or is part of
};

/// A board whose LEDs are separate blobs.
struct Ring {
  double u = 0.0, v = 0.0;  ///< where the ring's center appears [px]
  std::array<std::uint32_t, 6> lights{};
  std::size_t count = 0;  ///< of lights
};

/// Finds boards so near that their LEDs are lights of their own.
///
/// Any three neighbors a, b, c on a regular hexagon have its center at a + c - b, and an affine
/// view keeps that true. So every light votes for a center with each two of its near neighbors; two
/// votes at one place make a ring of four to six LEDs, no matter which are hidden. The lines
/// through opposite LEDs meet in the center under any perspective: where there are two or more, it
/// is there.
///
/// Half a ring is one vote, which three robots in a row with a bend give as well. It is believed
/// where the three are parts of one blob, or bright, alike and closer together than robots fly.
class RingFinder {
 public:
  RingFinder();

  /// Valid until the next call. A light belongs to one ring at most.
  [[nodiscard]] std::span<const Ring> find(std::span<const Light> lights);

 private:
  struct Vote {
    double u = 0.0, v = 0.0;
    double radius = 0.0;
    std::array<std::uint32_t, 3> lights{};
  };

  void vote(std::span<const Light> lights, std::uint32_t corner, std::size_t place);
  void count_votes(std::span<const Light> lights, std::size_t seed, std::size_t least);
  void accept_half_rings(std::span<const Light> lights);
  [[nodiscard]] bool is_free(const Vote& vote) const;

  std::vector<std::uint32_t> order_;  ///< lights by u
  std::vector<Vote> votes_;           ///< by u
  std::vector<std::uint8_t> is_taken_;
  std::vector<Ring> rings_;
};

}  // namespace crepes
