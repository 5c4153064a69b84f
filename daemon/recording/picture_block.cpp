#include "daemon/recording/picture_block.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "daemon/recording/block.hpp"

namespace crepes {
namespace {

template <class Items, class Text>
std::string list_of(const Items& items, const Text& text) {
  std::string list = "[";
  for (const auto& item : items) list += (list.size() > 1 ? "," : "") + text(item);
  return list + "]";
}

std::string robots_json(const PictureRobots* robots) {
  if (robots == nullptr) return "[]";
  return list_of(robots->bearings, [](const Bearing& bearing) {
    const Eigen::Vector3d& u_B = bearing.u_B;
    return fmt::format("[{},{:.6f},{:.6f},{:.6f}]", bearing.neighbor.value, u_B.x(), u_B.y(),
                       u_B.z());
  });
}

std::string head_of(const Picture& picture, const PictureRobots* robots, int scale) {
  const std::string spots = list_of(picture.spots, [](const Spot& spot) {
    return fmt::format("[{:.1f},{:.1f},{:.1f},{:.0f}]", spot.u_px, spot.v_px, spot.area_px2,
                       spot.peak);
  });
  const std::string hot = list_of(picture.hot_pixels, [](const MendedPixel& pixel) {
    return fmt::format("[{},{}]", pixel.u, pixel.v);
  });
  const Frame& frame = picture.frame;
  return fmt::format(
      R"({{"camera":{},"t_ns":"{}","width":{},"height":{},"scale":{},"background":{},)"
      R"("threshold":{},"saturated":{:.4f},"hot_pixels":{},"hot":{},"spots":{},"robots":{}}})"
      "\n",
      frame.camera, to_ns(frame.stamp), frame.width / scale, frame.height / scale, scale,
      picture.background, picture.threshold, picture.saturated_share, picture.hot_pixel_count, hot,
      spots, robots_json(robots));
}

/// Appends one row of the reduced picture.
void append_reduced_row(std::string& text, const Frame& frame, int row, int scale) {
  const std::size_t begin = text.size();
  const auto width = static_cast<std::size_t>(frame.width / scale);
  text.resize(begin + width, '\0');
  for (int v = row * scale; v < (row + 1) * scale; ++v) {
    const std::uint8_t* pixel = frame.data() + v * frame.stride();
    for (std::size_t u = 0; u < width; ++u) {
      auto brightest = static_cast<std::uint8_t>(text[begin + u]);
      for (int i = 0; i < scale; ++i) brightest = std::max(brightest, *pixel++);
      text[begin + u] = static_cast<char>(brightest);
    }
  }
}

}  // namespace

void append_picture(std::string& text, const Frame& frame) {
  std::string content =
      fmt::format("{} {} {} {}\n", frame.camera, to_ns(frame.stamp), frame.width, frame.height);
  content.append(frame.pixels.begin(), frame.pixels.end());
  append_block(text, "picture", content);
}

void append_look(std::string& text, const Picture& picture, const PictureRobots* robots) {
  const Frame& frame = picture.frame;
  const int scale = 1 + (std::max(frame.width, frame.height) - 1) / kMaxLookSide;
  std::string content = head_of(picture, robots, scale);
  for (int row = 0; row < frame.height / scale; ++row)
    append_reduced_row(content, frame, row, scale);
  append_block(text, "look", content);
}

}  // namespace crepes
