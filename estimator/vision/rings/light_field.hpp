/// The lights of one picture, and what the picture shows between them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/vision/blob_finder.hpp"

namespace crepes {

/// What may be a single LED.
struct Light {
  double u = 0.0, v = 0.0;  ///< center [px]
  std::int32_t area = 0;    ///< [px^2]
  int peak = 0;             ///< gray level
  std::uint32_t blob = 0;   ///< the blob that it is, or is part of
};

/// The lights of one picture, in the order in which they were given and sorted by column. It keeps
/// its memory from picture to picture.
class LightField {
 public:
  static constexpr std::size_t kMaxLights = 1024;
  /// The areas of a ring's lights differ by no larger factor.
  static constexpr double kRingArea = 3.0;

  LightField();

  /// At most kMaxLights `lights`, those of `image` above `threshold`. Both must outlive their use.
  void set(std::span<const Light> lights, const GrayImage& image, int threshold);

  [[nodiscard]] std::size_t size() const { return lights_.size(); }
  [[nodiscard]] const Light& operator[](std::size_t i) const { return lights_[i]; }
  /// The center of a light [px].
  [[nodiscard]] Eigen::Vector2d place_of(std::size_t i) const {
    return {lights_[i].u, lights_[i].v};
  }
  /// All lights by `u`.
  [[nodiscard]] std::span<const std::uint32_t> by_column() const { return order_; }
  /// Those from column `u` on.
  [[nodiscard]] std::span<const std::uint32_t> from_column(double u) const;

  /// Whether their areas differ by no more than a `factor`. There must be one.
  [[nodiscard]] bool are_alike(std::span<const std::uint32_t> members, double factor) const;
  /// Whether they are as bright and large as the LEDs of a board at less than a few meters.
  [[nodiscard]] bool are_leds(std::span<const std::uint32_t> members) const;
  /// Whether the picture is above the threshold at `uv` [px].
  [[nodiscard]] bool is_lit(const Eigen::Vector2d& uv) const;

 private:
  std::span<const Light> lights_;
  const GrayImage* image_ = nullptr;
  int threshold_ = 0;
  std::vector<std::uint32_t> order_;  ///< lights by u
};

/// The z component of a x b.
[[nodiscard]] inline double cross_of(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace crepes
