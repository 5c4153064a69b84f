#include "drivers/camera/watched_camera.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

#include "tests/support/manual_clock.hpp"

namespace crepes::watched_camera_test {
namespace {

using namespace std::chrono_literals;

/// Delivers the frames of the test.
class FakeCamera final : public Camera {
 public:
  explicit FakeCamera(std::deque<Frame>& frames) : frames_(frames) {}

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds) override {
    if (frames_.empty()) return std::optional<Frame>{};
    Frame frame = std::move(frames_.front());
    frames_.pop_front();
    return std::optional(std::move(frame));
  }
  [[nodiscard]] SensorTotals counters() const override { return {}; }

 private:
  std::deque<Frame>& frames_;
};

class WatchedCameraTest : public testing::Test {
 protected:
  static constexpr int kWidth = 40;
  static constexpr int kHeight = 33;

  void SetUp() override {
    config_.calibration.resolution = {kWidth, kHeight};
    config_.calibration.rate_hz = 100;
  }

  WatchedCamera& camera() {
    if (!camera_) camera_.emplace(std::make_unique<FakeCamera>(frames_), config_, clock_);
    return *camera_;
  }

  /// The camera's answer to one more frame, `period` after the last.
  std::string answer_to(std::vector<std::uint8_t> pixels, Duration period = 10ms) {
    clock_.advance(period);
    frames_.push_back(
        {.stamp = clock_.now(), .width = kWidth, .height = kHeight, .pixels = std::move(pixels)});
    return answer();
  }
  std::string answer() {
    const auto frame = camera().read_once(0ms);
    return frame ? "" : frame.error().message;
  }

  /// The result of such images for `duration`, or the first error.
  template <class Picture>
  std::string answer_for(Duration duration, const Picture& picture, Duration period = 10ms) {
    std::string reported;
    for (int i = 0; i * period < duration && reported.empty(); ++i)
      reported = answer_to(picture(i), period);
    return reported;
  }

  static std::vector<std::uint8_t> gray(std::uint8_t level) {
    return std::vector<std::uint8_t>(kWidth * kHeight, level);
  }
  static std::vector<std::uint8_t> noisy(int turn) {
    auto pixels = gray(20);
    pixels[static_cast<std::size_t>(turn % kWidth)] = 21;
    return pixels;
  }

  ManualClock clock_;
  CameraConfig config_;
  std::deque<Frame> frames_;
  std::optional<WatchedCamera> camera_;
};

TEST_F(WatchedCameraTest, PassesChangingImages) {
  EXPECT_EQ(answer_for(5s, noisy), "");
  EXPECT_EQ(camera().diagnosis(), std::nullopt);
}

TEST_F(WatchedCameraTest, EndsAStreamOfEqualImages) {
  ASSERT_EQ(answer_for(1s, noisy), "");
  const Timestamp hung = clock_.now();

  const std::string reported = answer_for(5s, [](int) { return gray(20); });

  EXPECT_NE(reported.find("frozen"), std::string::npos);
  EXPECT_LT(clock_.now() - hung, 1500ms);
}

TEST_F(WatchedCameraTest, AcceptsEqualDarkImages) {
  EXPECT_EQ(answer_for(5s, [](int) { return gray(0); }), "");
}

TEST_F(WatchedCameraTest, DetectsASinglePixelChangeBetweenTheRowsThatItCompares) {
  EXPECT_EQ(answer_for(5s,
                       [](int turn) {
                         auto pixels = gray(20);
                         pixels[kWidth * 5 + 7] = static_cast<std::uint8_t>(turn / 50 % 2);
                         return pixels;
                       }),
            "");
}

TEST_F(WatchedCameraTest, RefusesAnotherResolution) {
  frames_.push_back({.stamp = clock_.now(), .width = 33, .height = 40, .pixels = gray(20)});

  EXPECT_EQ(answer(), "frames of [33, 40] instead of resolution [40, 33]");
}

TEST_F(WatchedCameraTest, EndsAStalledStreamWithinTwoSeconds) {
  ASSERT_EQ(answer_for(1s, noisy), "");

  clock_.advance(1400ms);
  EXPECT_EQ(answer(), "");
  clock_.advance(200ms);
  EXPECT_NE(answer().find("no frame"), std::string::npos);
}

TEST_F(WatchedCameraTest, WaitsForAHardwareTriggerAsLongAsItTakes) {
  config_.device.trigger = CameraTrigger::kHardware;
  ASSERT_EQ(answer_for(1s, noisy), "");

  clock_.advance(60s);

  EXPECT_EQ(answer(), "");
}

TEST_F(WatchedCameraTest, ReportsAnotherRateThanConfigured) {
  ASSERT_EQ(answer_for(2s, noisy, 15ms), "");
  EXPECT_NE(camera().diagnosis().value_or("").find("fewer frames"), std::string::npos);

  ASSERT_EQ(answer_for(2s, noisy, 10ms), "");
  EXPECT_EQ(camera().diagnosis(), std::nullopt);

  ASSERT_EQ(answer_for(2s, noisy, 7ms), "");
  EXPECT_NE(camera().diagnosis().value_or("").find("more frames"), std::string::npos);
}

TEST_F(WatchedCameraTest, ReadsBorrowedMemoryByItsStride) {
  auto memory = gray(20);
  memory.resize(static_cast<std::size_t>(kHeight) * 64, 20);
  const auto lend = [&](int turn) {
    memory[static_cast<std::size_t>(turn % kWidth)] ^= 1U;
    Frame frame{.stamp = clock_.now(), .width = kWidth, .height = kHeight};
    frame.borrowed = BorrowedPixels(memory.data(), [](const std::uint8_t*) {});
    frame.borrowed_stride = 64;
    return frame;
  };
  for (int i = 0; i < 300; ++i) {
    clock_.advance(10ms);
    frames_.push_back(lend(i));
    ASSERT_EQ(answer(), "");
  }
}

}  // namespace
}  // namespace crepes::watched_camera_test
