/// Pictures of LED boards through a lens that blurs and a sensor that errs.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "drivers/sim/seeded_noise.hpp"
#include "estimator/core/pose.hpp"
#include "estimator/vision/camera_model.hpp"

namespace crepes {

/// LEDs at equal steps along a circle, or along the edges of a square with that incircle. They look
/// along x of the board's frame M.
struct LedBoard {
  int leds = 6;
  double radius_m = 0.03;
  bool is_square = false;
  double led_spread = 0.05;  ///< one sigma of the LEDs' brightness
  double veil = 0.0;         ///< light of a lens in the center, as a part of one LED's

  /// In M.
  [[nodiscard]] Eigen::Vector3d p_M_led(int led) const;
};

/// What lens, light and sensor do.
struct PictureEffects {
  double blur_px = 0.8;               ///< one sigma of a point's image
  double defocus_px = 0.0;            ///< radius of the disc that a point becomes
  double exposure_s = 0.0002;         ///< its light does not depend on it
  double light = 1.0;                 ///< times an LED that peaks at 7500 gray levels at 1 m
  double row_delay_s = 0.0;           ///< of a rolling shutter; stamps are those of the middle row
  double background = 10.0;           ///< gray levels
  double read_noise = 1.5;            ///< gray levels, one sigma
  double row_noise = 0.0;             ///< gray levels, one sigma, the same along a row
  int hot_pixels = 0;                 ///< of 30 to 250 gray levels
  double electrons_per_level = 40.0;  ///< sets the shot noise

  /// White, with soft edge: the sun, or with straight edges a window.
  struct Glare {
    Eigen::Vector2d center;
    Eigen::Vector2d half_size;  ///< equal for a disc
    bool is_disc = true;
  };
  std::optional<Glare> glare{};
};

/// A board on its way through the picture.
struct MovingBoard {
  LedBoard board;
  std::function<Pose(double t_s)> T_C_M;
  std::function<bool(double t_s)> is_lit;
};

/// Renders picture after picture of the same boards; equal seeds yield equal pictures.
class BoardRenderer {
 public:
  BoardRenderer(CameraModel camera, const PictureEffects& effects, std::uint64_t seed);

  void add(MovingBoard board) { boards_.push_back(std::move(board)); }

  /// The picture whose exposure has its middle at `t_s`, row by row; valid until the next call.
  [[nodiscard]] const std::vector<std::uint8_t>& render(double t_s);

 private:
  struct Patch {
    int left, top, right, bottom;  ///< right and bottom excluded
  };

  void add_background();
  void expose(const MovingBoard& board, std::uint64_t index, double t_s);
  void add_point(const Eigen::Vector2d& uv, double peak);

  CameraModel camera_;
  PictureEffects effects_;
  SeededNoise noise_;
  std::vector<MovingBoard> boards_;
  std::vector<std::uint8_t> background_;
  std::vector<std::int8_t> grain_;
  std::vector<float> light_;  ///< of the whole picture; zero between pictures
  Patch touched_{};
  std::vector<std::uint8_t> pixels_;
  std::uint64_t picture_ = 0;
};

}  // namespace crepes
