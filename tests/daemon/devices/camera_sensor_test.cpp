#include "daemon/devices/camera_sensor.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/manual_clock.hpp"

namespace crepes::camera_sensor_test {
namespace {

using namespace std::chrono_literals;

/// What the cameras of a test were asked for.
struct LightLog {
  std::vector<CameraLight> opened;
  std::vector<CameraLight> set;
};

/// Takes any exposure below 1000 us.
class PickyCamera final : public Camera {
 public:
  explicit PickyCamera(LightLog& log) : log_(log) {}

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds) override {
    return std::optional(Frame{});
  }
  [[nodiscard]] Result<void> set_light(const CameraLight& light) override {
    constexpr double kLongest = 1000.0;  // us
    if (light.exposure_us > kLongest) return fail(ErrorCode::kConfig, "exposure_us: too long");
    log_.set.push_back(light);
    return {};
  }
  [[nodiscard]] SensorTotals counters() const override { return {}; }

 private:
  LightLog& log_;
};

class CameraSensor : public testing::Test {
 protected:
  static CameraLight exposure(double us) { return {.exposure_us = us, .gain = {}}; }
  static LightSettings fixed(double us) { return {exposure(us), ExposureControl::kFixed}; }

  std::unique_ptr<Device> open() { return sensor_.open().value(); }

  LightLog log_;
  ManualClock clock_;
  FrameQueue frames_{1, Overflow::kDropOldest};
  FrameQueue recycled_{1, Overflow::kDropOldest};
  LiveLight light_{fixed(500)};
  Sensor sensor_ = camera_sensor(
      "cam0",
      [this](const CameraLight& light) -> Result<std::unique_ptr<Camera>> {
        log_.opened.push_back(light);
        return std::make_unique<PickyCamera>(log_);
      },
      light_, clock_, frames_, recycled_);
};

TEST_F(CameraSensor, ChangesTheLightOfACameraThatRuns) {
  const auto device = open();
  ASSERT_TRUE(device->read_once(0ms));
  EXPECT_TRUE(log_.set.empty());

  EXPECT_FALSE(device->has_new_settings());

  light_.update(fixed(300));
  EXPECT_TRUE(device->has_new_settings());
  ASSERT_TRUE(device->read_once(0ms));
  EXPECT_TRUE(log_.set.empty()) << "it may take seconds, which reading must not";
  device->apply_settings();

  EXPECT_EQ(log_.set, std::vector<CameraLight>{exposure(300)});
  EXPECT_FALSE(device->has_new_settings());
}

TEST_F(CameraSensor, GoesOnWithTheLightThatItHasWhereOneIsRefused) {
  const auto device = open();
  light_.update(fixed(2000));
  device->apply_settings();

  EXPECT_EQ(device->read_once(0ms).value(), 1U);
  EXPECT_EQ(device->diagnosis(), "exposure_us: too long");

  light_.update(fixed(400));
  device->apply_settings();
  EXPECT_EQ(device->read_once(0ms).value(), 1U);
  EXPECT_EQ(device->diagnosis(), std::nullopt);
}

TEST_F(CameraSensor, OpensACameraThatReturnsWithTheNewestLight) {
  static_cast<void>(open());
  light_.update(fixed(300));

  static_cast<void>(open());

  EXPECT_EQ(log_.opened, (std::vector{exposure(500), exposure(300)}));
  EXPECT_TRUE(log_.set.empty());
}

}  // namespace
}  // namespace crepes::camera_sensor_test
