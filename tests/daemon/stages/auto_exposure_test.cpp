#include "daemon/stages/auto_exposure.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "drivers/sim/ring_renderer.hpp"
#include "estimator/vision/blink_tracker.hpp"
#include "estimator/vision/spot_detector.hpp"
#include "tests/support/forward_camera.hpp"

namespace crepes::auto_exposure_test {
namespace {

constexpr double kLongest = 500.0;  // us
constexpr double kWhite = 250.0;    // gray levels
constexpr Duration kFrame = std::chrono::milliseconds{5};
constexpr Duration kBetweenTrials = std::chrono::seconds{17};

LightSettings automatic() {
  return {{.exposure_us = kLongest, .gain = {}}, ExposureControl::kAuto};
}

/// Boards at distances [m], before a camera without noise whose exposure follows.
class Scene {
 public:
  static constexpr PictureLevels kLevels{.background = 12.0, .threshold = 28.0};

  explicit Scene(std::vector<double> distances) : distances_(std::move(distances)) {}

  void run_for(Duration duration, const PictureLevels& levels = kLevels) {
    for (const Timestamp end = now_ + duration; now_ < end; now_ += kFrame) {
      std::vector<Bearing> boards;
      for (std::size_t i = 0; i < distances_.size(); ++i) {
        if (peak(i) < levels.threshold) continue;
        boards.push_back({.stamp = now_,
                          .neighbor = RobotId{static_cast<std::uint16_t>(i + 2)},
                          .peak = peak(i)});
      }
      control_.add(boards);
      if (const auto exposure_us = control_.step(now_, levels)) {
        exposure_us_ = *exposure_us;
        ++changes_;
      }
    }
  }
  void add_board(double distance_m) { distances_.push_back(distance_m); }
  void clear() { distances_.clear(); }

  [[nodiscard]] double exposure_us() const { return exposure_us_; }
  [[nodiscard]] int changes() const { return changes_; }
  /// Of a board, gray level.
  [[nodiscard]] double peak(std::size_t board) const {
    constexpr double kAtOneMeter = 7500.0;  // at the longest exposure
    const double light =
        kAtOneMeter * exposure_us_ / kLongest / (distances_[board] * distances_[board]);
    return std::min(255.0, kLevels.background + light);
  }

 private:
  std::vector<double> distances_;
  AutoExposure control_{automatic()};
  double exposure_us_ = kLongest;
  Timestamp now_{};
  int changes_ = 0;
};

TEST(AutoExposure, HoldsANearBoardBelowWhite) {
  Scene scene({2.0});
  scene.run_for(std::chrono::seconds{12});

  EXPECT_LT(scene.peak(0), kWhite);
  EXPECT_GT(scene.peak(0), 150.0);
}

TEST(AutoExposure, LeavesAFarBoardTheExposureThatItNeeds) {
  Scene scene({2.0, 14.0});
  scene.run_for(std::chrono::seconds{12});

  EXPECT_GT(scene.peak(1), 45.0);
  EXPECT_GT(scene.exposure_us(), 0.8 * kLongest);
}

TEST(AutoExposure, FindsAFarBoardThatComesWhileAnotherIsNear) {
  Scene scene({1.5});
  scene.run_for(std::chrono::seconds{10});
  scene.add_board(12.0);
  ASSERT_LT(scene.peak(1), Scene::kLevels.threshold) << "or there is nothing to find";

  scene.run_for(kBetweenTrials);

  EXPECT_GE(scene.peak(1), Scene::kLevels.threshold + 15.0);
}

TEST(AutoExposure, GoesBackToTheLongestWhenNobodyIsThere) {
  Scene scene({1.0});
  scene.run_for(std::chrono::seconds{12});
  ASSERT_LT(scene.exposure_us(), 0.2 * kLongest);
  scene.clear();

  scene.run_for(std::chrono::seconds{8});

  EXPECT_EQ(scene.exposure_us(), kLongest);
}

TEST(AutoExposure, IsShorterWhereThePictureIsBrightAllOver) {
  Scene scene({10.0});
  scene.run_for(std::chrono::seconds{3}, {.background = 90.0, .threshold = 106.0});

  EXPECT_LT(scene.exposure_us(), 0.5 * kLongest);
}

TEST(AutoExposure, LeavesAFixedExposureAlone) {
  AutoExposure control({{.exposure_us = kLongest, .gain = {}}, ExposureControl::kFixed});
  for (int k = 0; k < 1000; ++k) {
    control.add(std::vector<Bearing>{{.neighbor = RobotId{2}, .peak = 255.0}});
    EXPECT_FALSE(control.step(Timestamp{k * kFrame}, Scene::kLevels));
  }
  EXPECT_FALSE(control.exposure_us());
}

RC_GTEST_PROP(AutoExposure, SettlesWhateverIsInView, ()) {
  std::vector<double> distances;
  const int boards = *rc::gen::inRange(1, 6);
  for (int i = 0; i < boards; ++i) distances.push_back(0.01 * *rc::gen::inRange(50, 1500));
  Scene scene(distances);
  scene.run_for(kBetweenTrials);
  const int before = scene.changes();
  scene.run_for(kBetweenTrials);

  RC_ASSERT(scene.changes() - before <= 3);  // to a trial, back, and what the trial found
  RC_ASSERT(scene.exposure_us() <= kLongest);
  RC_ASSERT(scene.exposure_us() >= kLongest / 33.0);
  double brightest = 0.0;
  double faintest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < distances.size(); ++i) {
    brightest = std::max(brightest, scene.peak(i));
    faintest = std::min(faintest, scene.peak(i));
  }
  const bool is_limited = scene.exposure_us() <= kLongest / 31.0;
  RC_ASSERT(brightest < kWhite || is_limited || faintest <= Scene::kLevels.threshold + 26.0);
  RC_ASSERT(faintest >= Scene::kLevels.threshold + 15.0 || scene.exposure_us() == kLongest);
}

SwarmConfig two_robots() {
  SwarmConfig swarm;
  for (std::uint16_t id = 1; id <= 2; ++id) {
    MemberConfig member;
    member.id = RobotId{id};
    member.name = "r" + std::to_string(id);
    member.pattern = id == 1 ? "011111111111111111" : "001001011111111111";
    member.p_body_led = {0.05, 0.0, 0.01};
    swarm.members.push_back(member);
  }
  return swarm;
}

/// What rendered pictures, the detector and the tracker make of it.
struct Watched {
  int frames = 0;  ///< in which the board is lit and in view
  int named = 0;   ///< of them
  int white = 0;   ///< of those
  double shortest_us = kLongest;
};

Watched watch(SimScenario scenario, const LightSettings& settings, double from_s, double to_s) {
  SimConfig config;
  config.scenario = scenario;
  const SimWorld world(config);
  const CameraCalibration camera = forward_camera();
  const SwarmConfig swarm = two_robots();
  auto renderer = RingRenderer::make(world, RobotId{1}, swarm, camera, 0);
  EXPECT_TRUE(renderer) << renderer.error().message;
  const IdLibrary library = IdLibrary::from(swarm).value();
  SpotDetector detector{VisionConfig{}};
  BlinkTracker tracker(camera, CameraModel::from(camera).value(), VisionConfig{}, library,
                       RobotId{1});
  AutoExposure control(settings);
  Watched watched;
  constexpr double kPeriod = 0.005;
  for (double t = 0.0; t < to_s; t += kPeriod) {
    const bool is_lit = !renderer->views(t).empty();
    Frame frame = renderer->render(t);
    const Timestamp stamp{from_seconds(t)};
    const Detection found = detector.detect({.pixels = frame.pixels.data(),
                                             .width = frame.width,
                                             .height = frame.height,
                                             .stride = frame.width});
    const std::vector<Bearing> boards =
        tracker.step({stamp, 0, {found.spots.begin(), found.spots.end()}});
    control.add(boards);
    const PictureLevels levels{.background = static_cast<double>(found.background),
                               .threshold = static_cast<double>(found.threshold)};
    if (const auto exposure_us = control.step(stamp, levels))
      renderer->set_brightness(*exposure_us / kLongest);
    renderer->recycle(std::move(frame));
    watched.shortest_us = std::min(watched.shortest_us, control.exposure_us().value_or(kLongest));
    if (t < from_s || !is_lit) continue;
    ++watched.frames;
    watched.named += boards.empty() ? 0 : 1;
    watched.white += !boards.empty() && boards.front().peak >= kWhite ? 1 : 0;
  }
  return watched;
}

TEST(AutoExposure, KeepsABoardBelowWhiteInRenderedPictures) {
  const LightSettings fixed{automatic().light, ExposureControl::kFixed};
  const Watched before = watch(SimScenario::kTwo, fixed, 6.0, 14.0);
  const Watched after = watch(SimScenario::kTwo, automatic(), 6.0, 14.0);

  EXPECT_GT(before.white, 0.9 * before.named) << "or there is nothing to do";
  EXPECT_LT(after.white, 0.1 * after.named);
  EXPECT_GE(after.named, 0.98 * before.named);
}

TEST(AutoExposure, LosesNoBoardThatFliesAwayToTheEndOfSight) {
  const LightSettings fixed{automatic().light, ExposureControl::kFixed};
  const Watched before = watch(SimScenario::kLongRange, fixed, 6.0, 34.0);
  const Watched after = watch(SimScenario::kLongRange, automatic(), 6.0, 34.0);

  EXPECT_LT(after.shortest_us, 0.9 * kLongest) << "or there is nothing to lose";
  EXPECT_GE(after.named, 0.98 * before.named);
}

}  // namespace
}  // namespace crepes::auto_exposure_test
