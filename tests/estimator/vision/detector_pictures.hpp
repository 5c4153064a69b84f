/// What the pictures for a spot detector are made of, and how far off a spot is.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/pose.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/vision/camera_model.hpp"

namespace crepes::test {

inline constexpr double kPixelsPerRadian = 382.0;  // of small_fisheye() at its center

/// Distance from where it should be [px].
inline double off(const Spot& spot, const Eigen::Vector2d& uv) {
  return (Eigen::Vector2d(spot.u_px, spot.v_px) - uv).norm();
}

/// A board facing the camera whose center appears at `uv`.
inline Pose facing_board(const CameraModel& camera, const Eigen::Vector2d& uv, double range_m) {
  const Eigen::Vector3d toward = camera.unproject(uv).value();
  return {range_m * toward, shortest_rotation(Eigen::Vector3d::UnitX(), -toward)};
}

/// A picture whose pixel (u, v) is level(u, v).
template <class Level>
std::vector<std::uint8_t> picture(int width, int height, const Level& level) {
  std::vector<std::uint8_t> pixels;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) pixels.push_back(static_cast<std::uint8_t>(level(u, v)));
  return pixels;
}

}  // namespace crepes::test
