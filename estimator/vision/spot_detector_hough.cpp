#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "estimator/vision/spot_detector.hpp"

namespace crepes {

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
    std::vector<cv::Vec3f> circles;
    cv::HoughCircles(closed, circles, cv::HOUGH_GRADIENT, 1.0, 8.0, 100.0, 5.0, 1, 60);
    for (const cv::Vec3f& circle : circles) {
      const double area = CV_PI * circle[2] * circle[2];
      if (area < config.min_area_px2 || area > config.max_area_px2) continue;
      if (spots.size() >= static_cast<std::size_t>(config.max_spots)) break;
      const cv::Rect box =
          cv::Rect(static_cast<int>(circle[0] - circle[2]) - 1,
                   static_cast<int>(circle[1] - circle[2]) - 1, static_cast<int>(2 * circle[2]) + 3,
                   static_cast<int>(2 * circle[2]) + 3) &
          cv::Rect(0, 0, image.width, image.height);
      double peak = 0.0;
      cv::minMaxLoc(gray(box), nullptr, &peak);
      spots.push_back({.u_px = circle[0], .v_px = circle[1], .area_px2 = area, .peak = peak});
    }
    return {};
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::kFormat, std::string("detector hough: ") + e.what());
  }
}

}  // namespace crepes
