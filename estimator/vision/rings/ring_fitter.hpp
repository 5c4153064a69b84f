/// The board of which some lights are LEDs, by its shape.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/vision/ring_model.hpp"
#include "estimator/vision/rings/light_field.hpp"
#include "estimator/vision/rings/ring.hpp"

namespace crepes {

/// Compares lights with the shapes of all boards: round rings of 4 to 16 LEDs, and squares.
/// `members` are lights of `field`, at most kMaxRingLeds, in their order around the ring.
class RingFitter {
 public:
  RingFitter();

  /// The ring whose LEDs are all of these lights.
  [[nodiscard]] std::optional<Ring> whole_ring(const LightField& field,
                                               std::span<const std::uint32_t> members) const;
  /// The ring of which these lights are an arc, which begins after their longest gap or the second.
  [[nodiscard]] std::optional<Ring> arc(const LightField& field,
                                        std::span<const std::uint32_t> members) const;
  /// The ring of six of which three lights are half.
  [[nodiscard]] std::optional<Ring> half_ring(const LightField& field,
                                              std::span<const std::uint32_t> members) const;
  /// Adds the rings of more than few lights to `candidates` of which these are four LEDs in a row.
  void add_rings_with(const LightField& field, const std::array<std::uint32_t, 4>& row,
                      std::vector<Ring>& candidates) const;

 private:
  [[nodiscard]] std::optional<Ring> arc_after(const LightField& field,
                                              std::span<const std::uint32_t> members,
                                              std::size_t first) const;

  std::vector<RingShape> shapes_;  ///< by number of LEDs
  RingShape hexagon_;
};

}  // namespace crepes
