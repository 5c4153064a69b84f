/// How a ring of LEDs appears in a picture.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace crepes {

inline constexpr int kMinRingLeds = 4;
inline constexpr int kMaxRingLeds = 16;

/// Where the LEDs of a board are, in its plane, about its center: at equal steps along a circle of
/// radius 1 or along the edges of a square with that incircle.
struct RingShape {
  std::vector<Eigen::Vector2d> places;  ///< in their order along the ring

  [[nodiscard]] static RingShape round(int leds);
  /// The first LED is in a corner. `leds` is a multiple of four.
  [[nodiscard]] static RingShape square(int leds);

  [[nodiscard]] bool is_round() const { return places[0].y() == 0.0; }
  [[nodiscard]] int leds() const { return static_cast<int>(places.size()); }
};

/// A view of a board's plane: the place q appears at center + axes q / (1 + slant q), which is any
/// perspective view of a plane.
struct RingView {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();    ///< [px]
  Eigen::Matrix2d axes = Eigen::Matrix2d::Identity();  ///< [px]
  Eigen::Vector2d slant = Eigen::Vector2d::Zero();     ///< 0 for a view from afar

  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& place) const {
    return center + axes * place / (1.0 + slant.dot(place));
  }
  /// The place that appears at `uv`, from afar.
  [[nodiscard]] Eigen::Vector2d place_near(const Eigen::Vector2d& uv) const;
  /// Half the longer axis of the ellipse as which a round ring appears [px].
  [[nodiscard]] double radius() const;
  /// Shorter to longer axis, the cosine of the angle at which the ring is seen.
  [[nodiscard]] double roundness() const;
  /// Root mean square distance of `seen` from where `places` appear [px].
  [[nodiscard]] double rms(std::span<const Eigen::Vector2d> seen,
                           std::span<const Eigen::Vector2d> places) const;
};

/// The view in which `places` appear nearest to `seen`, by least squares. Nothing for less than
/// three places or places on a line.
[[nodiscard]] std::optional<RingView> fit_from_afar(std::span<const Eigen::Vector2d> seen,
                                                    std::span<const Eigen::Vector2d> places);

/// The same with perspective, whose extent is known beforehand from the ring's size in the picture.
[[nodiscard]] std::optional<RingView> fit_perspective(const RingView& from_afar,
                                                      std::span<const Eigen::Vector2d> seen,
                                                      std::span<const Eigen::Vector2d> places);

}  // namespace crepes
