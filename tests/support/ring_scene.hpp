/// Pictures of LED boards as a lens and a sensor make them.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "estimator/core/pose.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/vision/blob_finder.hpp"
#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/ring_model.hpp"

namespace crepes::test {

/// What a lens and a sensor do to light.
struct Optics {
  double blur_px = 0.8;      ///< one sigma of a point's image
  double glow = 0.001;       ///< part of the light that is scattered over
  double glow_px = 4.0;      ///< one sigma
  double exposure = 1.0;     ///< times that at which an LED 1 m away peaks at kLedAtOneMeter
  double dark_level = 10.0;  ///< gray levels
  double read_noise = 1.5;   ///< gray levels, one sigma
  double electrons_per_level = 40.0;  ///< sets the shot noise
};

/// A ring of LEDs that all look along its axis.
struct RingBoard {
  int leds = 6;
  bool is_square = false;  ///< along the edges of a square, of which `radius_m` is the incircle
  double lens = 0.0;       ///< light in the center, as a part of one LED's
  double radius_m = 0.03;
  double led_spread = 0.05;   ///< one sigma of the LEDs' brightness
  unsigned hidden = 0;        ///< bit k: LED k is hidden
  double cosine_power = 1.0;  ///< emission falls with this power of the cosine to the axis
};

/// A picture in the making.
class RingScene {
 public:
  static constexpr double kLedAtOneMeter = 7500.0;  ///< gray levels of the peak

  RingScene(const CameraModel& camera, const Optics& optics, unsigned seed)
      : camera_(camera),
        optics_(optics),
        random_(seed),
        light_(static_cast<std::size_t>(camera.width() * camera.height()), 0.0F) {}

  /// Light of a point at `uv`; `peak` is that of its sharp image [gray levels].
  void add_point(const Eigen::Vector2d& uv, double peak) {
    const double sharp = optics_.blur_px;
    const double wide = optics_.glow_px;
    add_gaussian(uv, sharp, peak * (1.0 - optics_.glow));
    add_gaussian(uv, wide, peak * optics_.glow * sharp * sharp / (wide * wide));
  }

  /// The axis of the board is x of `T_C_M`. Returns where the ring's center appears.
  Eigen::Vector2d add_ring(const Pose& T_C_M, const RingBoard& board = {}) {
    std::normal_distribution<double> spread(1.0, board.led_spread);
    const RingShape shape =
        board.is_square ? RingShape::square(board.leds) : RingShape::round(board.leds);
    for (std::size_t k = 0; k <= shape.places.size(); ++k) {
      const bool is_lens = k == shape.places.size();
      if (is_lens && board.lens <= 0.0) continue;
      const double gain = is_lens ? board.lens : spread(random_);
      if ((board.hidden >> k & 1U) != 0) continue;
      const Eigen::Vector2d place = is_lens ? Eigen::Vector2d::Zero() : shape.places[k];
      const Eigen::Vector3d p_C =
          T_C_M * (board.radius_m * Eigen::Vector3d(0.0, place.x(), place.y()));
      const double cosine = -(T_C_M.q * Eigen::Vector3d::UnitX()).dot(p_C.normalized());
      const auto uv = camera_.project(p_C);
      if (cosine <= 0.0 || !uv) continue;
      add_point(*uv, gain * optics_.exposure * kLedAtOneMeter *
                         std::pow(cosine, board.cosine_power) / p_C.squaredNorm());
    }
    return camera_.project(T_C_M.p).value();
  }

  /// A disc as bright as `level`, with soft edge.
  void add_disc(const Eigen::Vector2d& uv, double radius_px, double level) {
    for (int v = 0; v < camera_.height(); ++v)
      for (int u = 0; u < camera_.width(); ++u)
        at(u, v) += static_cast<float>(
            level / (1.0 + std::exp((std::hypot(u - uv.x(), v - uv.y()) - radius_px) / 1.5)));
  }

  void set_pixel(int u, int v, double level) { at(u, v) = static_cast<float>(level); }
  float& at(int u, int v) { return light_[static_cast<std::size_t>(v * camera_.width() + u)]; }

  /// Exposes and reads the sensor. Valid until the next call.
  GrayImage read() {
    std::normal_distribution<float> normal;
    pixels_.resize(light_.size());
    for (std::size_t i = 0; i < light_.size(); ++i) {
      const double shot = std::max(0.0F, light_[i]) / optics_.electrons_per_level;
      const double sigma = std::sqrt(shot + optics_.read_noise * optics_.read_noise);
      const double level = optics_.dark_level + light_[i] + sigma * normal(random_);
      pixels_[i] = static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    }
    return {pixels_.data(), camera_.width(), camera_.height(), camera_.width()};
  }

 private:
  /// Light within a pixel is integrated with Simpson's rule across it.
  static double over_pixel(double offset, double sigma) {
    const auto bell = [&](double d) { return std::exp(-d * d / (2.0 * sigma * sigma)); };
    return (bell(offset - 0.5) + 4.0 * bell(offset) + bell(offset + 0.5)) / 6.0;
  }

  void add_gaussian(const Eigen::Vector2d& uv, double sigma, double peak) {
    constexpr double kFaintest = 0.05;  // gray levels
    if (peak < kFaintest) return;
    const int reach =
        static_cast<int>(std::ceil(sigma * std::sqrt(2.0 * std::log(peak / kFaintest)))) + 1;
    const int u0 = std::max(0, static_cast<int>(uv.x()) - reach);
    const int u1 = std::min(camera_.width() - 1, static_cast<int>(uv.x()) + reach);
    const int v0 = std::max(0, static_cast<int>(uv.y()) - reach);
    const int v1 = std::min(camera_.height() - 1, static_cast<int>(uv.y()) + reach);
    for (int v = v0; v <= v1; ++v) {
      const double down = peak * over_pixel(v - uv.y(), sigma);
      for (int u = u0; u <= u1; ++u)
        at(u, v) += static_cast<float>(down * over_pixel(u - uv.x(), sigma));
    }
  }

  CameraModel camera_;
  Optics optics_;
  std::mt19937 random_;
  std::vector<float> light_;
  std::vector<std::uint8_t> pixels_;
};

/// A camera of 185 degrees, small enough to render a sweep of pictures quickly.
inline CameraModel small_fisheye() {
  CameraCalibration config;
  config.intrinsics = {-0.1723, 0.5931, 316.8, 316.6, 160.2, 127.6};
  config.resolution = {320, 256};
  return CameraModel::from(config).value();
}

/// A board at `range_m` that appears near the center of the picture, turned away by `tilt_rad`
/// around a random line across the view.
inline Pose random_board(std::mt19937& random, double range_m, double tilt_rad) {
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  const double down = 0.12 * part(random);
  const double right = 0.15 * part(random);
  const Eigen::Vector3d toward = Eigen::Vector3d(right, down, 1.0).normalized();
  const Eigen::Quaterniond facing = shortest_rotation(Eigen::Vector3d::UnitX(), -toward);
  const double roll = std::numbers::pi * part(random);
  const double around = std::numbers::pi * part(random);
  const Eigen::Quaterniond tilt =
      so3_exp(tilt_rad * Eigen::Vector3d(0.0, std::cos(around), std::sin(around)));
  return {range_m * toward, facing * tilt * so3_exp(roll * Eigen::Vector3d::UnitX())};
}

}  // namespace crepes::test
