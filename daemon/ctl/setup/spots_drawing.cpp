#include "daemon/ctl/setup/spots_drawing.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace crepes {
namespace {

// Blue, green, red.
const cv::Scalar kSpotColor(80, 220, 80);
const cv::Scalar kRobotColor(40, 160, 255);
const cv::Scalar kCaptionColor(230, 230, 230);
constexpr double kCircleGap = 6.0;  // px between a spot and its circle
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr int kShift = 4;  // bits of a coordinate behind the point

cv::Point fine(double u_px, double v_px) {
  return {static_cast<int>(std::lround(u_px * (1 << kShift))),
          static_cast<int>(std::lround(v_px * (1 << kShift)))};
}

void draw_robot(cv::Mat& canvas, const DrawnRobot& robot) {
  for (std::size_t i = 1; i < robot.trail_px.size(); ++i) {
    const Eigen::Vector2d& from = robot.trail_px[i - 1];
    const Eigen::Vector2d& to = robot.trail_px[i];
    cv::line(canvas, fine(from.x(), from.y()), fine(to.x(), to.y()), kRobotColor, 1, cv::LINE_AA,
             kShift);
  }
  const Eigen::Vector2d& at = robot.trail_px.back();
  cv::putText(canvas, fmt::format("{} {}", robot.id.value, robot.name),
              {static_cast<int>(at.x()) + 14, static_cast<int>(at.y()) - 10}, kFont, 0.6,
              kRobotColor, 1, cv::LINE_AA);
}

}  // namespace

Result<void> draw_spots(const Frame& frame, std::span<const Spot> spots,
                        std::span<const DrawnRobot> robots, const std::string& caption,
                        const std::filesystem::path& file) {
  try {
    cv::Mat gray(frame.height, frame.width, CV_8UC1);
    std::copy(frame.pixels.begin(), frame.pixels.end(), gray.begin<std::uint8_t>());
    cv::Mat canvas;
    cv::cvtColor(gray, canvas, cv::COLOR_GRAY2BGR);
    for (const Spot& spot : spots) {
      const double radius = kCircleGap + std::sqrt(spot.area_px2 / std::numbers::pi);
      cv::circle(canvas, fine(spot.u_px, spot.v_px),
                 static_cast<int>(std::lround(radius * (1 << kShift))), kSpotColor, 1, cv::LINE_AA,
                 kShift);
    }
    for (const DrawnRobot& robot : robots)
      if (!robot.trail_px.empty()) draw_robot(canvas, robot);
    cv::putText(canvas, caption, {10, 22}, kFont, 0.55, kCaptionColor, 1, cv::LINE_AA);
    if (cv::imwrite(file.string(), canvas)) return {};
    return fail(ErrorCode::kIo, file.string() + ": cannot be written");
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::kIo, fmt::format("{}: {}", file.string(), e.what()));
  }
}

}  // namespace crepes
