#include "drivers/camera/aravis_camera.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstring>

#include "drivers/base/monotonic_clock.hpp"
#include "drivers/camera/watched_camera.hpp"
#include "tests/support/counted.hpp"
#include "tests/support/gige_camera.hpp"

namespace crepes::aravis_camera_test {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPatience = 20s;

/// Another grey each time, and noise enough to be alive.
GigeCamera::Paint changing_picture() {
  return [turn = 0](const GigeCamera::Picture& picture) mutable {
    std::memset(picture.pixels, 20 + ++turn % 100, picture.size());
  };
}

class AravisCameraTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!enter_own_network()) GTEST_SKIP() << "no right to a network of our own";
    config_.calibration.name = "cam0";
    config_.device.id = GigeCamera::kAddress;
    config_.calibration.resolution = {640, 480};
    config_.calibration.rate_hz = 50;
    config_.device.light.exposure_us = 700;
    config_.device.light.gain = 3;
    config_.device.packet_size = 9000;
  }

  Result<std::unique_ptr<Camera>> open() { return open_aravis_camera(config_, 3, clock_); }

  /// The last few frames, until `enough` says so. All of them would leave the driver no buffers.
  template <class Enough>
  std::vector<Frame> read_until(Camera& camera, const Enough& enough) {
    std::vector<Frame> frames;
    const Timestamp end = clock_.now() + kPatience;
    while (clock_.now() < end && !enough(frames)) {
      auto frame = camera.read_once(50ms);
      if (!frame) {
        last_error_ = frame.error().message;
        return frames;
      }
      if (*frame) frames.push_back(std::move(**frame));
      if (frames.size() > 5) frames.erase(frames.begin());
    }
    return frames;
  }

  CameraConfig config_;
  MonotonicClock clock_;
  std::string last_error_;
};

TEST_F(AravisCameraTest, DeliversPicturesWhereTheyWereReceived) {
  const GigeCamera device(changing_picture());
  ASSERT_TRUE(device.is_running());
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;

  const auto frames = read_until(**camera, [](const auto& f) { return f.size() == 5; });

  ASSERT_EQ(frames.size(), 5U) << last_error_;
  for (const Frame& frame : frames) {
    EXPECT_TRUE(frame.pixels.empty());
    EXPECT_EQ(frame.width, 640);
    EXPECT_EQ(frame.height, 480);
    EXPECT_EQ(frame.camera, 3);
    const std::uint8_t* last_row = frame.data() + 479 * frame.stride();
    EXPECT_EQ(*frame.data(), last_row[639]);
    EXPECT_GE(*frame.data(), 20);
  }
  EXPECT_GT(frames[1].stamp, frames[0].stamp);
  EXPECT_NE(*frames[0].data(), *frames[1].data());
  EXPECT_EQ((*camera)->diagnosis(), std::nullopt);
}

TEST_F(AravisCameraTest, GetsItsBuffersBackWhenFramesEnd) {
  const GigeCamera device(changing_picture());
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  int seen = 0;

  const Timestamp end = clock_.now() + kPatience;
  while (seen < 60 && clock_.now() < end) {
    const auto frame = (*camera)->read_once(50ms);
    ASSERT_TRUE(frame) << frame.error().message;
    if (*frame) ++seen;
  }

  EXPECT_EQ(seen, 60);
  EXPECT_EQ(faults_of(**camera, "underruns"), 0U);
}

TEST_F(AravisCameraTest, KeepsAFramesMemoryThoughTheCameraIsClosed) {
  const GigeCamera device(changing_picture());
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  const auto frames = read_until(**camera, [](const auto& f) { return f.size() == 1; });
  ASSERT_EQ(frames.size(), 1U) << last_error_;

  camera->reset();

  EXPECT_EQ(frames[0].data()[0], frames[0].data()[640 * 480 - 1]);
}

TEST_F(AravisCameraTest, HandsOnTheNewestWhenItFellBehind) {
  std::atomic<int> painted = 0;
  const GigeCamera device([&, paint = changing_picture()](const GigeCamera::Picture& picture) {
    paint(picture);
    ++painted;
    painted.notify_one();
  });
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;

  const auto first = read_until(**camera, [](const auto& f) { return f.size() == 1; });
  for (int i = painted + 6; painted < i;) painted.wait(painted);
  const auto next = read_until(**camera, [](const auto& f) { return f.size() == 1; });

  ASSERT_EQ(next.size(), 1U) << last_error_;
  EXPECT_GT(counts_of(**camera, "superseded"), 0U);
  EXPECT_GT(*next[0].data(), *first[0].data() + 2);
}

TEST_F(AravisCameraTest, CountsAndReportsLostPackets) {
  GigeCamera device(changing_picture(), 0.02);
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;

  read_until(**camera, [&](const auto&) {
    return (*camera)->diagnosis().has_value() && faults_of(**camera, "incomplete") > 5;
  });

  EXPECT_NE((*camera)->diagnosis().value_or("").find("incomplete"), std::string::npos);
  EXPECT_GT(faults_of(**camera, "missing_packets"), 0U);
  device.lose_packets(0.0);
  read_until(**camera, [&](const auto&) { return !(*camera)->diagnosis(); });
  EXPECT_EQ((*camera)->diagnosis(), std::nullopt);
}

TEST_F(AravisCameraTest, EndsWhenTheCameraIsUnpluggedAndOpensItAgain) {
  auto device = std::make_unique<GigeCamera>(changing_picture());
  auto opened = open();
  ASSERT_TRUE(opened) << opened.error().message;
  auto camera = std::make_unique<WatchedCamera>(std::move(*opened), config_, clock_);
  ASSERT_EQ(read_until(*camera, [](const auto& f) { return !f.empty(); }).size(), 1U);

  device.reset();
  const Timestamp unplugged = clock_.now();
  read_until(*camera, [](const auto&) { return false; });

  EXPECT_FALSE(last_error_.empty());
  EXPECT_LT(clock_.now() - unplugged, 2s);
  device = std::make_unique<GigeCamera>(changing_picture());
  camera.reset();
  auto again = open();
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_FALSE(read_until(**again, [](const auto& f) { return !f.empty(); }).empty());
}

TEST_F(AravisCameraTest, NamesTheCameraThatIsNotThere) {
  config_.device.id = GigeCamera::kId;

  const auto camera = open();

  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().code, ErrorCode::kNotFound);
  EXPECT_NE(camera.error().message.find(GigeCamera::kId), std::string::npos);
}

TEST_F(AravisCameraTest, RefusesARegionOutsideOfTheSensor) {
  const GigeCamera device(changing_picture());
  config_.device.offset = {2040, 0};

  const auto camera = open();

  ASSERT_FALSE(camera);
  EXPECT_NE(camera.error().message.find("[640, 480] at offset [2040, 0]"), std::string::npos)
      << camera.error().message;
  EXPECT_NE(camera.error().message.find("2048 x 2048"), std::string::npos);
}

TEST_F(AravisCameraTest, ReportsAnExposureThatIsLongerThanAFrame) {
  const GigeCamera device(changing_picture());
  config_.device.light.exposure_us = 30000;

  const auto camera = open();

  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_NE((*camera)->diagnosis().value_or("").find("exposure"), std::string::npos);
}

TEST_F(AravisCameraTest, ChangesTheExposureWhileItRuns) {
  const GigeCamera device(changing_picture());
  const auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  ASSERT_EQ((*camera)->diagnosis(), std::nullopt);

  EXPECT_TRUE((*camera)->set_light({.exposure_us = 30000.0, .gain = 6.0}));
  EXPECT_NE((*camera)->diagnosis().value_or("").find("exposure"), std::string::npos);
  EXPECT_TRUE((*camera)->set_light({.exposure_us = 500.0, .gain = {}}));

  EXPECT_EQ((*camera)->diagnosis(), std::nullopt);
  EXPECT_FALSE(read_until(**camera, [](const auto& frames) { return !frames.empty(); }).empty());
}

TEST_F(AravisCameraTest, FindsTheOnlyCameraAndListsIt) {
  const GigeCamera device(changing_picture());
  config_.device.id = "";

  const auto found = find_aravis_cameras();
  const auto camera = open();

  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].device, GigeCamera::kId);
  EXPECT_TRUE(camera) << camera.error().message;
}

TEST_F(AravisCameraTest, SaysThatThereIsNone) {
  config_.device.id = "";

  const auto camera = open();

  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().message, "no USB3 Vision or GigE Vision camera");
}

}  // namespace
}  // namespace crepes::aravis_camera_test
