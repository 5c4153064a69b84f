#include "estimator/vision/rings/light_field.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

constexpr std::int32_t kLedArea = 8;  // px^2
constexpr int kLedPeak = 250;

}  // namespace

LightField::LightField() { order_.reserve(kMaxLights); }

void LightField::set(std::span<const Light> lights, const GrayImage& image, int threshold) {
  lights_ = lights;
  image_ = &image;
  threshold_ = threshold;
  const auto count = static_cast<std::uint32_t>(lights.size());
  order_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) order_[i] = i;
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return lights[a].u != lights[b].u ? lights[a].u < lights[b].u : a < b;
  });
}

std::span<const std::uint32_t> LightField::from_column(double u) const {
  const auto first = std::partition_point(order_.begin(), order_.end(),
                                          [&](std::uint32_t i) { return lights_[i].u < u; });
  return {first, order_.end()};
}

bool LightField::are_alike(std::span<const std::uint32_t> members, double factor) const {
  std::int32_t least = lights_[members[0]].area;
  std::int32_t most = least;
  for (const std::uint32_t i : members) {
    least = std::min(least, lights_[i].area);
    most = std::max(most, lights_[i].area);
  }
  return most <= factor * least;
}

bool LightField::are_leds(std::span<const std::uint32_t> members) const {
  return std::all_of(members.begin(), members.end(), [&](std::uint32_t i) {
    return lights_[i].peak >= kLedPeak && lights_[i].area >= kLedArea;
  });
}

bool LightField::is_lit(const Eigen::Vector2d& uv) const {
  const auto u = static_cast<int>(std::lround(uv.x()));
  const auto v = static_cast<int>(std::lround(uv.y()));
  return u >= 0 && v >= 0 && u < image_->width && v < image_->height &&
         image_->row(v)[u] >= threshold_;
}

}  // namespace crepes
