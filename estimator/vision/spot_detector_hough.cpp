#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "estimator/vision/spot_detector.hpp"

namespace crepes {
namespace {

/// The circle with the most votes around a disc: center and radius [px]. The edge of a disc of a
/// few pixels has too few of them to vote, so it is enlarged.
std::optional<cv::Vec3f> circle_in(const cv::Mat& discs, const cv::Rect& box) {
  constexpr int kMargin = 2;
  constexpr int kSize = 24;  // of what is enlarged; larger ones are taken as they are
  constexpr double kEdge = 30.0;
  constexpr double kVotes = 10.0;
  const int size = std::max(box.width, box.height);
  const int scale = std::clamp(kSize / size, 1, 16);
  const cv::Rect around = cv::Rect(box.x - kMargin, box.y - kMargin, box.width + 2 * kMargin,
                                   box.height + 2 * kMargin) &
                          cv::Rect(0, 0, discs.cols, discs.rows);
  cv::Mat enlarged;
  cv::resize(discs(around), enlarged, {}, scale, scale, cv::INTER_CUBIC);
  cv::GaussianBlur(enlarged, enlarged, {}, 1.5 * scale);
  std::vector<cv::Vec3f> circles;
  cv::HoughCircles(enlarged, circles, cv::HOUGH_GRADIENT, 1.0, 2.0 * scale * size, kEdge, kVotes,
                   scale * size * 3 / 8, scale * size * 3 / 4);
  if (circles.empty()) return std::nullopt;
  const auto in_picture = [&](float at, int start) {
    return (at + 0.5F) / static_cast<float>(scale) - 0.5F + static_cast<float>(start);
  };
  return cv::Vec3f(in_picture(circles[0][0], around.x), in_picture(circles[0][1], around.y),
                   circles[0][2] / static_cast<float>(scale));
}

}  // namespace

Result<void> find_circles(const GrayImage& image, int threshold, const VisionConfig& config,
                          std::vector<Spot>& spots) {
  try {
    // OpenCV takes pixels as mutable; nothing here writes to them.
    const cv::Mat gray(
        image.height, image.width, CV_8UC1,
        const_cast<std::uint8_t*>(image.pixels),  // NOLINT(cppcoreguidelines-pro-type-const-cast)
        static_cast<std::size_t>(image.stride));
    cv::Mat binary;
    cv::threshold(gray, binary, threshold - 1, 255, cv::THRESH_BINARY);
    cv::Mat closed;  // the LEDs of a ring become one disc
    cv::morphologyEx(binary, closed, cv::MORPH_CLOSE,
                     cv::getStructuringElement(cv::MORPH_ELLIPSE, {9, 9}));
    std::vector<std::vector<cv::Point>> contours;
    cv::findContours(closed, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE);
    const double widest = 2.0 * std::sqrt(config.max_area_px2 / CV_PI);
    for (const std::vector<cv::Point>& contour : contours) {
      if (spots.size() >= static_cast<std::size_t>(config.max_spots)) break;
      const cv::Rect box = cv::boundingRect(contour);
      if (std::max(box.width, box.height) > widest) continue;  // the sun, a window
      const std::optional<cv::Vec3f> circle = circle_in(closed, box);
      if (!circle) continue;
      const double area = CV_PI * (*circle)[2] * (*circle)[2];
      if (area < config.min_area_px2 || area > config.max_area_px2) continue;
      double peak = 0.0;
      cv::minMaxLoc(gray(box), nullptr, &peak);
      spots.push_back({.u_px = (*circle)[0], .v_px = (*circle)[1], .area_px2 = area, .peak = peak});
    }
    return {};
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::kFormat, std::string("detector hough: ") + e.what());
  }
}

}  // namespace crepes
