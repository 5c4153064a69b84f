#include "drivers/sim/board_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace crepes {
namespace {

constexpr double kLedPeakAtOneMeter = 7500.0;   // gray levels
constexpr double kFaintestLight = 0.1;          // gray levels; fainter light is ignored
constexpr std::size_t kNoiseDraws = 1U << 16U;  // a power of two
constexpr int kStepsPerExposure = 12;           // when it is long
constexpr double kShortExposure = 0.0003;       // s
constexpr double kEdge = 0.5;                   // px, softness of a disc
constexpr double kGlare = 3000.0;               // gray levels

std::uint8_t to_gray(double level) {
  return static_cast<std::uint8_t>(std::clamp(level + 0.5, 0.0, 255.0));
}

double logistic(double x) { return 1.0 / (1.0 + std::exp(x)); }

/// How bright a point's image is `distance` from its center, 1 for the peak of a sharp one.
class PointImage {
 public:
  explicit PointImage(const PictureEffects& effects)
      : sigma_(effects.blur_px), radius_(effects.defocus_px) {
    if (radius_ <= 0.0) return;
    scale_ = 2.0 * sigma_ * sigma_ / (radius_ * radius_);  // the same light in all
  }
  [[nodiscard]] double at(double distance) const {
    if (radius_ > 0.0) return scale_ * logistic((distance - radius_) / kEdge);
    return std::exp(-0.5 * distance * distance / (sigma_ * sigma_));
  }
  [[nodiscard]] int reach(double peak) const {
    if (radius_ > 0.0) return static_cast<int>(std::ceil(radius_ + 10.0 * kEdge));
    return static_cast<int>(std::ceil(sigma_ * std::sqrt(2.0 * std::log(peak / kFaintestLight)))) +
           1;
  }

 private:
  double sigma_;
  double radius_;
  double scale_ = 1.0;
};

}  // namespace

Eigen::Vector3d LedBoard::p_M_led(int led) const {
  if (!is_square) {
    const double angle = 2.0 * std::numbers::pi * led / leds;
    return radius_m * Eigen::Vector3d(0.0, std::cos(angle), std::sin(angle));
  }
  const double along = 4.0 * led / leds;  // edges from the first corner
  const int edge = static_cast<int>(along);
  const double part = 2.0 * (along - edge) - 1.0;
  const double angle = 0.5 * std::numbers::pi * edge;
  return radius_m * Eigen::Vector3d(0.0, std::cos(angle) - part * std::sin(angle),
                                    std::sin(angle) + part * std::cos(angle));
}

BoardRenderer::BoardRenderer(CameraModel camera, const PictureEffects& effects, std::uint64_t seed)
    : camera_(std::move(camera)), effects_(effects), noise_{0x73656eU, seed} {
  light_.assign(static_cast<std::size_t>(camera_.width() * camera_.height()), 0.0F);
  for (std::size_t i = 0; i < kNoiseDraws; ++i)
    grain_.push_back(
        static_cast<std::int8_t>(std::lround(effects_.read_noise * noise_.gaussian(i))));
  add_background();
}

void BoardRenderer::add_background() {
  const auto& glare = effects_.glare;
  const auto glare_at = [&](double u, double v) {
    const Eigen::Vector2d d = Eigen::Vector2d(u, v) - glare->center;
    if (glare->is_disc) return kGlare * logistic((d.norm() - glare->half_size.x()) / 1.5);
    const Eigen::Vector2d over = d.cwiseAbs() - glare->half_size;
    return kGlare * logistic(over.maxCoeff() / kEdge);
  };
  for (int v = 0; v < camera_.height(); ++v)
    for (int u = 0; u < camera_.width(); ++u)
      background_.push_back(to_gray(effects_.background + (glare ? glare_at(u, v) : 0.0)));
  for (int i = 0; i < effects_.hot_pixels; ++i) {
    const auto k = kNoiseDraws + 3 * static_cast<std::uint64_t>(i);
    const auto place =
        static_cast<std::size_t>(noise_.uniform(k) * static_cast<double>(background_.size()));
    background_[place] = to_gray(30.0 + 220.0 * noise_.uniform(k + 1));
  }
}

const std::vector<std::uint8_t>& BoardRenderer::render(double t_s) {
  const SeededNoise noise{0x706963U, static_cast<std::uint64_t>(1e18 * noise_.uniform(0)),
                          picture_++};
  touched_ = {camera_.width(), camera_.height(), 0, 0};
  for (std::size_t i = 0; i < boards_.size(); ++i) expose(boards_[i], i, t_s);
  pixels_ = background_;
  const auto width = static_cast<std::size_t>(camera_.width());
  for (std::size_t v = 0; v < static_cast<std::size_t>(camera_.height()); ++v) {
    const int shift = static_cast<int>(std::lround(effects_.row_noise * noise.gaussian(v)));
    const auto from = static_cast<std::size_t>(noise.uniform(v + 10'000) *
                                               static_cast<double>(kNoiseDraws - width));
    std::uint8_t* row = pixels_.data() + v * width;
    const std::int8_t* grain = grain_.data() + from;
    const float* light = light_.data() + v * width;
    const bool is_touched =
        static_cast<int>(v) >= touched_.top && static_cast<int>(v) < touched_.bottom;
    for (std::size_t u = 0; u < width && !is_touched; ++u)
      row[u] = static_cast<std::uint8_t>(std::clamp(row[u] + grain[u] + shift, 0, 255));
    for (std::size_t u = 0; u < width && is_touched; ++u) {
      const double sigma = effects_.read_noise + std::sqrt(light[u] / effects_.electrons_per_level);
      const double noisy = light[u] + grain[u] * sigma / std::max(0.1, effects_.read_noise);
      row[u] = to_gray(std::max(0.0, row[u] + shift + noisy));
    }
  }
  for (int v = touched_.top; v < touched_.bottom; ++v) {
    auto* row = light_.data() + static_cast<std::ptrdiff_t>(v) * camera_.width();
    std::fill(row + touched_.left, row + touched_.right, 0.0F);
  }
  return pixels_;
}

/// Adds the light of one board, step by step of its exposure.
void BoardRenderer::expose(const MovingBoard& moving, std::uint64_t index, double t_s) {
  const LedBoard& board = moving.board;
  const int steps = effects_.exposure_s > kShortExposure ? kStepsPerExposure : 1;
  for (int step = 0; step < steps; ++step) {
    const double t_step = t_s + effects_.exposure_s * ((step + 0.5) / steps - 0.5);
    for (int led = 0; led <= board.leds; ++led) {
      const bool is_veil = led == board.leds;
      if (is_veil && board.veil <= 0.0) continue;
      const Eigen::Vector3d p_M = is_veil ? Eigen::Vector3d::Zero() : board.p_M_led(led);
      double t = t_step;
      auto uv = camera_.project(moving.T_C_M(t) * p_M);
      for (int round = 0; uv && effects_.row_delay_s > 0.0 && round < 2; ++round) {
        t = t_step + effects_.row_delay_s * (uv->y() - 0.5 * (camera_.height() - 1));
        uv = camera_.project(moving.T_C_M(t) * p_M);
      }
      if (!uv || !moving.is_lit(t)) continue;
      const Pose T_C_M = moving.T_C_M(t);
      const Eigen::Vector3d p_C = T_C_M * p_M;
      const double cosine = -(T_C_M.q * Eigen::Vector3d::UnitX()).dot(p_C.normalized());
      if (cosine <= 0.0) continue;
      const SeededNoise gain{0x676169U, index};
      const double of_led =
          is_veil ? board.veil
                  : 1.0 + board.led_spread * gain.gaussian(static_cast<std::uint64_t>(led));
      add_point(*uv, of_led * effects_.light * kLedPeakAtOneMeter * cosine /
                         (std::max(p_C.squaredNorm(), 0.01) * steps));
    }
  }
}

void BoardRenderer::add_point(const Eigen::Vector2d& uv, double peak) {
  if (peak <= kFaintestLight) return;
  const PointImage image(effects_);
  const int reach = image.reach(peak);
  const auto u0 = static_cast<int>(std::lround(uv.x()));
  const auto v0 = static_cast<int>(std::lround(uv.y()));
  const Patch patch{std::max(0, u0 - reach), std::max(0, v0 - reach),
                    std::min(camera_.width(), u0 + reach + 1),
                    std::min(camera_.height(), v0 + reach + 1)};
  if (patch.left >= patch.right || patch.top >= patch.bottom) return;
  touched_ = {std::min(touched_.left, patch.left), std::min(touched_.top, patch.top),
              std::max(touched_.right, patch.right), std::max(touched_.bottom, patch.bottom)};
  for (int v = patch.top; v < patch.bottom; ++v) {
    float* row = light_.data() + static_cast<std::ptrdiff_t>(v) * camera_.width();
    for (int u = patch.left; u < patch.right; ++u)
      row[u] += static_cast<float>(peak * image.at(std::hypot(u - uv.x(), v - uv.y())));
  }
}

}  // namespace crepes
