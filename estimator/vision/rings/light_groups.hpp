/// Clusters of lights that may be the LEDs of one board.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/vision/ring_model.hpp"
#include "estimator/vision/rings/light_field.hpp"

namespace crepes {

/// Single-linkage clustering of lights that are like each other. It joins them link by link, the
/// shortest first, into a tree of groups. It keeps its memory from picture to picture.
class LightGroups {
 public:
  static constexpr std::size_t kNearest = 3;
  /// All LEDs of a ring and the lens in its middle.
  static constexpr std::size_t kMaxMembers = kMaxRingLeds + 1;
  using Members = std::array<std::uint32_t, kMaxMembers>;

  LightGroups();

  /// Links every light of `field` with its nearest that are like it.
  void link_nearest(const LightField& field);
  /// The nearest that are like light `i`; itself for none.
  [[nodiscard]] const std::array<std::uint32_t, kNearest>& nearest_to(std::size_t i) const {
    return near_[i];
  }

  /// Starts to join the lights of the last link_nearest() from single ones.
  void restart();
  /// Joins what is not taken until there is a group that may be a ring: of 3 to kMaxMembers lights
  /// that are alike. Empty once all are joined. Valid until the next call. `is_taken`: by light.
  [[nodiscard]] std::optional<std::span<const std::uint32_t>> next(
      const LightField& field, std::span<const std::uint8_t> is_taken);

 private:
  struct Link {
    double length;
    std::uint32_t a, b;
  };

  [[nodiscard]] std::uint32_t root_of(std::uint32_t i);

  std::vector<Link> links_;
  std::vector<std::array<std::uint32_t, kNearest>> near_;
  std::size_t next_link_ = 0;
  std::vector<std::uint32_t> parent_;  ///< union-find over lights
  std::vector<std::uint32_t> next_;    ///< the groups as cycles
  std::vector<std::uint32_t> size_;    ///< of the group, at its root
  Members members_{};                  ///< of the group that was returned
};

}  // namespace crepes
