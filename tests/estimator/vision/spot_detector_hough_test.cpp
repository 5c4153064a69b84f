/// The spot detector of the paper.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "estimator/vision/spot_detector.hpp"
#include "tests/estimator/vision/detector_pictures.hpp"
#include "tests/support/ring_scene.hpp"

namespace crepes::spot_detector_hough_test {
namespace {

using test::facing_board;
using test::off;
using test::picture;
using test::RingScene;
using test::small_fisheye;

TEST(SpotDetector, OfThePaperFindsTheSameBoard) {
  const CameraModel camera = small_fisheye();
  RingScene scene(camera, {}, 3);
  const Eigen::Vector2d board = scene.add_ring(facing_board(camera, {150.0, 120.0}, 2.3));
  VisionConfig config;
  config.detector = SpotDetectorKind::kHough;
  SpotDetector detector{config};

  const Detection found = detector.detect(scene.read());

  ASSERT_EQ(found.spots.size(), 1U);
  EXPECT_LT(off(found.spots[0], board), 1.0);
  EXPECT_TRUE(found.failure.empty());
}

TEST(SpotDetector, OfThePaperFindsAllOfManySmallBoards) {
  const CameraModel camera = small_fisheye();
  RingScene scene(camera, {}, 4);
  std::vector<Eigen::Vector2d> boards;
  for (const double range_m : {2.0, 3.0, 4.5, 6.0}) {
    const Eigen::Vector2d at(40.0 * range_m, 30.0 + 30.0 * range_m);
    boards.push_back(scene.add_ring(facing_board(camera, at, range_m)));
  }
  VisionConfig config;
  config.detector = SpotDetectorKind::kHough;
  SpotDetector detector{config};

  const Detection found = detector.detect(scene.read());

  EXPECT_EQ(found.spots.size(), boards.size());
  for (const Eigen::Vector2d& board : boards) {
    const bool is_found =
        std::ranges::any_of(found.spots, [&](const Spot& s) { return off(s, board) < 2.0; });
    EXPECT_TRUE(is_found) << board.transpose();
  }
}

TEST(SpotDetector, OfThePaperTakesNoWindowForABoard) {
  const auto pixels = picture(
      640, 480, [](int u, int v) { return u > 100 && u < 400 && v > 100 && v < 400 ? 255 : 10; });
  VisionConfig config;
  config.detector = SpotDetectorKind::kHough;
  SpotDetector detector{config};

  EXPECT_TRUE(detector.detect({pixels.data(), 640, 480, 640}).spots.empty());
}

/// OpenCV without memory.
struct NoMemory : cv::MatAllocator {
  [[noreturn]] static void refuse() { throw cv::Exception(cv::Error::StsNoMem, "none", "", "", 0); }
  cv::UMatData* allocate(int, const int*, int, void*, size_t*, cv::AccessFlag,
                         cv::UMatUsageFlags) const override {
    refuse();
  }
  bool allocate(cv::UMatData*, cv::AccessFlag, cv::UMatUsageFlags) const override { refuse(); }
  void deallocate(cv::UMatData*) const override {}
};

TEST(SpotDetector, OfThePaperSaysWhenOpenCvFails) {
  const auto pixels = picture(320, 240, [](int u, int v) { return u * v % 50; });
  VisionConfig config;
  config.detector = SpotDetectorKind::kHough;
  SpotDetector detector{config};
  NoMemory no_memory;
  cv::MatAllocator* const usual = cv::Mat::getDefaultAllocator();

  cv::Mat::setDefaultAllocator(&no_memory);
  const std::string failure(detector.detect({pixels.data(), 320, 240, 320}).failure);
  cv::Mat::setDefaultAllocator(usual);

  EXPECT_NE(failure.find("hough"), std::string::npos) << failure;
  EXPECT_TRUE(detector.detect({pixels.data(), 320, 240, 320}).failure.empty());
}

}  // namespace
}  // namespace crepes::spot_detector_hough_test
