/// A flat grid of LEDs before a fisheye camera.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "estimator/calibration/grid/grid_lens.hpp"
#include "estimator/calibration/grid/grid_order.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/pose.hpp"
#include "estimator/core/so3.hpp"

namespace crepes::simulated {

inline constexpr int kGridWidth = 640;
inline constexpr int kGridHeight = 512;

/// 185 deg in a circle of 250 px, off the picture's center.
inline GridLens grid_camera() {
  GridLens lens{.kind = LensKind::kDoubleSphere, .numbers = Eigen::VectorXd(6)};
  lens.numbers << -0.17, 0.59, 154.0, 153.2, 325.0, 250.5;
  return lens;
}

inline GridShape five_by_seven() { return {.rows = 5, .columns = 7, .pitch_m = 0.05}; }

struct SeenLed {
  int row = 0;
  int column = 0;
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();
};
struct SeenGrid {
  Pose T_C_G;
  std::vector<SeenLed> leds;  ///< on the picture alone
};

/// How the grid is held.
struct GridMotion {
  double least_tilt_deg = 10.0;
  double most_tilt_deg = 55.0;
  double most_off_axis_deg = 75.0;  ///< of its middle
  double least_distance_m = 0.25;
  double most_distance_m = 0.6;
};

/// Pictures of the grid at random places.
inline std::vector<SeenGrid> seen_grids(std::uint64_t seed, int count, const GridMotion& motion,
                                        const GridLens& lens = grid_camera(),
                                        const GridShape& shape = five_by_seven()) {
  std::mt19937_64 dice(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(dice() >> 11U) * 0x1p-53;
  };
  std::vector<SeenGrid> grids;
  for (int k = 0; k < count; ++k) {
    const double off_axis = radians(motion.most_off_axis_deg) * std::sqrt(uniform(0.0, 1.0));
    const double around = uniform(0.0, 2.0 * M_PI);
    const Eigen::Vector3d toward(std::sin(off_axis) * std::cos(around),
                                 std::sin(off_axis) * std::sin(around), std::cos(off_axis));
    const double tilt = radians(uniform(motion.least_tilt_deg, motion.most_tilt_deg));
    const double tilt_axis = uniform(0.0, 2.0 * M_PI);
    const Eigen::Quaterniond q_C_G =
        shortest_rotation(Eigen::Vector3d::UnitZ(), toward) *
        so3_exp(tilt * Eigen::Vector3d(std::cos(tilt_axis), std::sin(tilt_axis), 0.0)) *
        so3_exp(Eigen::Vector3d(0.0, 0.0, uniform(0.0, 2.0 * M_PI)));
    const Eigen::Vector3d middle(0.5 * shape.pitch_m * (shape.columns - 1),
                                 0.5 * shape.pitch_m * (shape.rows - 1), 0.0);
    const Eigen::Vector3d p_C = uniform(motion.least_distance_m, motion.most_distance_m) * toward;
    SeenGrid& grid = grids.emplace_back();
    grid.T_C_G = {p_C - q_C_G * middle, q_C_G};
    for (int row = 0; row < shape.rows; ++row) {
      for (int column = 0; column < shape.columns; ++column) {
        const auto uv = lens.project(
            grid.T_C_G * Eigen::Vector3d(shape.pitch_m * column, shape.pitch_m * row, 0.0));
        if (uv && uv->x() > 3.0 && uv->y() > 3.0 && uv->x() < kGridWidth - 4 &&
            uv->y() < kGridHeight - 4)
          grid.leds.push_back({row, column, *uv});
      }
    }
  }
  return grids;
}

/// A picture in which LEDs are unequally bright and bloom, over a dim and noisy background.
struct RenderedGrid {
  std::vector<std::uint8_t> pixels;

  explicit RenderedGrid(std::uint64_t seed) : dice_(seed) {
    for (int i = 0; i < kGridWidth * kGridHeight; ++i) light_.push_back(6.0 + 2.0 * normal());
  }
  void add(const Eigen::Vector2d& uv, double peak, double sigma_px) {
    const int reach = static_cast<int>(std::ceil(6.0 * sigma_px));
    const int u = static_cast<int>(std::lround(uv.x()));
    const int v = static_cast<int>(std::lround(uv.y()));
    for (int y = std::max(0, v - reach); y <= std::min(kGridHeight - 1, v + reach); ++y)
      for (int x = std::max(0, u - reach); x <= std::min(kGridWidth - 1, u + reach); ++x)
        light_[static_cast<std::size_t>(y * kGridWidth + x)] +=
            peak *
            std::exp(-0.5 * (Eigen::Vector2d(x, y) - uv).squaredNorm() / (sigma_px * sigma_px));
  }
  void expose() {
    for (const double light : light_)
      pixels.push_back(static_cast<std::uint8_t>(std::clamp(light, 0.0, 255.0)));
  }
  [[nodiscard]] double uniform() { return static_cast<double>(dice_() >> 11U) * 0x1p-53; }

 private:
  [[nodiscard]] double normal() {
    return std::sqrt(-2.0 * std::log(1.0 - uniform())) * std::cos(2.0 * M_PI * uniform());
  }
  std::mt19937_64 dice_;
  std::vector<double> light_;
};

/// The grid's LEDs, two or three reflections, a lamp.
inline RenderedGrid rendered(const SeenGrid& grid, std::uint64_t seed) {
  RenderedGrid picture(seed);
  for (const SeenLed& led : grid.leds)
    picture.add(led.uv, 60.0 + 500.0 * std::pow(picture.uniform(), 2),
                1.2 + 0.6 * picture.uniform());
  for (int k = 0; k < 3; ++k)
    picture.add({20.0 + 600.0 * picture.uniform(), 20.0 + 470.0 * picture.uniform()}, 150.0, 1.5);
  picture.add({30.0 + 580.0 * picture.uniform(), 30.0}, 900.0, 6.0);
  picture.expose();
  return picture;
}

/// RMS over the directions within `most_deg` of the axis of what a lens is wrong by, after the
/// small rotation that is best.
inline double shape_error_px(const GridLens& found, const GridLens& truth, double most_deg) {
  std::vector<Eigen::Vector2d> errors;
  std::vector<Eigen::Matrix<double, 2, 3>> turns;
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  for (double u = 5.0; u < kGridWidth; u += 20.0) {
    for (double v = 5.0; v < kGridHeight; v += 20.0) {
      const auto u_C = truth.direction({u, v});
      if (!u_C || std::acos(u_C->z()) > radians(most_deg)) continue;
      const auto seen = found.project(*u_C);
      if (!seen) return 1e3;
      Eigen::Matrix<double, 2, 3> J;
      for (int i = 0; i < 3; ++i) {
        const auto moved = found.project(so3_exp(1e-5 * Eigen::Vector3d::Unit(i)) * *u_C);
        if (!moved) return 1e3;
        J.col(i) = (*moved - *seen) / 1e-5;
      }
      errors.push_back(Eigen::Vector2d(u, v) - *seen);
      turns.push_back(J);
      H += J.transpose() * J;
      g += J.transpose() * errors.back();
    }
  }
  const Eigen::Vector3d turn = H.ldlt().solve(g);
  double sum = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i)
    sum += (errors[i] - turns[i] * turn).squaredNorm();
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

}  // namespace crepes::simulated
