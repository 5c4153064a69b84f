#include "drivers/camera/libcamera_camera.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

#include "drivers/camera/grey_conversion.hpp"
#include "tests/support/counted.hpp"
#include "tests/support/manual_clock.hpp"

namespace crepes::libcamera_camera_test {
namespace {

using namespace std::chrono_literals;

/// The behavior of the camera in a test, and the requests that it received.
struct FakeSensor {
  LibcameraStream stream{kGreyLayouts[0], 32, 20, 64};
  std::array<std::vector<std::uint8_t>, 4> memory;
  std::deque<std::uint32_t> free{0, 1, 2, 3};
  std::deque<LibcameraFrame> completed;
  std::uint64_t sequence = 0;
  CameraLight light;
  bool is_gone = false;
  bool is_open = false;

  /// The sensor takes a picture with this byte everywhere.
  void shoot(std::uint8_t level, LibcameraFrame frame = {}) {
    frame.sequence = ++sequence;
    if (free.empty()) return;
    frame.buffer = free.front();
    free.pop_front();
    memory[frame.buffer].assign(stream.stride * static_cast<std::size_t>(stream.height), level);
    completed.push_back(frame);
  }
};

class FakeDevice final : public LibcameraDevice {
 public:
  explicit FakeDevice(FakeSensor& sensor) : sensor_(sensor) { sensor_.is_open = true; }
  FakeDevice(const FakeDevice&) = delete;
  FakeDevice& operator=(const FakeDevice&) = delete;
  FakeDevice(FakeDevice&&) = delete;
  FakeDevice& operator=(FakeDevice&&) = delete;
  ~FakeDevice() override { sensor_.is_open = false; }

  [[nodiscard]] const LibcameraStream& stream() const override { return sensor_.stream; }
  [[nodiscard]] std::span<const std::uint8_t> memory(std::uint32_t buffer) const override {
    return sensor_.memory[buffer];
  }
  [[nodiscard]] Result<std::optional<LibcameraFrame>> next(std::chrono::milliseconds) override {
    if (sensor_.is_gone) return fail(ErrorCode::kIo, "imx296: the camera is gone");
    if (sensor_.completed.empty()) return std::optional<LibcameraFrame>{};
    const LibcameraFrame frame = sensor_.completed.front();
    sensor_.completed.pop_front();
    return std::optional(frame);
  }
  void requeue(std::uint32_t buffer) override { sensor_.free.push_back(buffer); }
  [[nodiscard]] Result<void> set_light(const CameraLight& light) override {
    sensor_.light = light;
    return {};
  }

 private:
  FakeSensor& sensor_;
};

class LibcameraCameraTest : public testing::Test {
 protected:
  void SetUp() override {
    config_.calibration.resolution = {32, 20};
    config_.calibration.rate_hz = 100;
    config_.device.latency_ms = 4.0;
    clock_.set(Timestamp{100s});
  }
  std::unique_ptr<Camera> open() {
    return make_libcamera_camera(std::make_unique<FakeDevice>(sensor_), config_, 1, clock_);
  }
  static Frame read(Camera& camera) {
    auto frame = camera.read_once(10ms);
    EXPECT_TRUE(frame && *frame);
    return frame && *frame ? std::move(**frame) : Frame{};
  }

  FakeSensor sensor_;
  CameraConfig config_;
  ManualClock clock_;
};

TEST_F(LibcameraCameraTest, BorrowsBytesWithTheirStrideAndGivesTheBuffersBack) {
  const auto camera = open();
  for (std::uint8_t i = 0; i < 20; ++i) {
    sensor_.shoot(i);
    const Frame frame = read(*camera);

    EXPECT_TRUE(frame.pixels.empty());
    EXPECT_EQ(frame.stride(), 64);
    EXPECT_EQ(frame.height, 20);
    EXPECT_EQ(frame.camera, 1);
    EXPECT_EQ(*frame.data(), i);
    EXPECT_EQ(sensor_.free.size(), 3U);
  }
  EXPECT_EQ(sensor_.free.size(), 4U);
}

TEST_F(LibcameraCameraTest, UnpacksEveryDeeperLayoutAndUsesTheMemoryAgain) {
  for (const GreyLayout& layout : kGreyLayouts) {
    if (layout.packing == GreyPacking::kBytes) continue;
    sensor_.stream.layout = layout;
    sensor_.stream.stride = layout.row_bytes(32) + 3;
    const auto camera = open();
    sensor_.shoot(0x01);

    Frame frame = read(*camera);

    const bool is_packed = layout.packing != GreyPacking::kWords;
    const int level =
        is_packed ? 0x01 : std::min(0x0101, (1 << layout.bits) - 1) >> (layout.bits - 8);
    EXPECT_EQ(frame.pixels, std::vector<std::uint8_t>(32 * 20, static_cast<std::uint8_t>(level)))
        << layout.name;
    EXPECT_EQ(sensor_.free.size(), 4U);
    const std::uint8_t* memory = frame.data();
    camera->recycle(std::move(frame));
    sensor_.shoot(0x00);
    EXPECT_EQ(read(*camera).data(), memory);
  }
}

TEST_F(LibcameraCameraTest, ReturnsTheNewestAndCountsSkippedMissedAndBrokenFrames) {
  const auto camera = open();
  for (std::uint8_t i = 1; i <= 6; ++i) sensor_.shoot(i, {.is_whole = i != 2});  // four buffers

  const Frame frame = read(*camera);

  EXPECT_EQ(*frame.data(), 4);
  EXPECT_EQ(counts_of(*camera, "superseded"), 2U);
  EXPECT_EQ(faults_of(*camera, "incomplete"), 1U);
  EXPECT_EQ(sensor_.free.size(), 3U);
  sensor_.shoot(7);
  EXPECT_EQ(*read(*camera).data(), 7);
  EXPECT_EQ(faults_of(*camera, "missed"), 2U);
}

TEST_F(LibcameraCameraTest, StampsByTheSensorsClockWhateverTheArrivalsDo) {
  const auto camera = open();
  Duration worst{};
  for (int i = 0; i < 3000; ++i) {
    const Timestamp exposed = Timestamp{200s} + i * 10ms;
    const Duration delay = 6ms + (i * 7 % 11) * 1ms;  // 6 ms at least
    clock_.set(exposed + delay);
    // The clock of the sensor is the machine's with the time of its sleep: 5000 s ahead.
    sensor_.shoot(1, {.sensor_ns = static_cast<std::uint64_t>(to_ns(exposed + 5000s))});

    const Duration error = read(*camera).stamp - (exposed + 6ms - 4ms);
    if (i > 500) worst = std::max(worst, error < Duration{} ? -error : error);
  }
  EXPECT_LT(worst, 1ms);
  EXPECT_EQ(faults_of(*camera, "clock_restarts"), 0U);
}

TEST_F(LibcameraCameraTest, StampsByTheArrivalWithoutASensorsClock) {
  const auto camera = open();
  sensor_.shoot(1);

  EXPECT_EQ(read(*camera).stamp, Timestamp{100s} - 4ms);
}

TEST_F(LibcameraCameraTest, ReportsAnExposureLongerThanAFrame) {
  const auto camera = open();
  sensor_.shoot(1, {.exposure_us = 9000.0});
  static_cast<void>(read(*camera));
  EXPECT_EQ(camera->diagnosis(), std::nullopt);

  sensor_.shoot(1, {.exposure_us = 11000.0});
  static_cast<void>(read(*camera));

  EXPECT_NE(camera->diagnosis().value_or("").find("exposure_us"), std::string::npos);
}

TEST_F(LibcameraCameraTest, SetsTheLightWhileItRuns) {
  const auto camera = open();

  ASSERT_TRUE(camera->set_light({.exposure_us = 300.0, .gain = 2.0}));

  EXPECT_EQ(sensor_.light, (CameraLight{300.0, 2.0}));
}

TEST_F(LibcameraCameraTest, KeepsTheDeviceForAsLongAsAFrameIsAway) {
  auto camera = open();
  sensor_.shoot(1);
  auto frame = std::make_unique<Frame>(read(*camera));

  camera.reset();
  EXPECT_TRUE(sensor_.is_open);
  frame.reset();

  EXPECT_FALSE(sensor_.is_open);
}

TEST_F(LibcameraCameraTest, ReportsThatTheCameraIsGone) {
  const auto camera = open();
  sensor_.is_gone = true;

  const auto frame = camera->read_once(10ms);

  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().message, "imx296: the camera is gone");
}

TEST(GreyConversion, KeepsTheUpperBytesOfPackedLevels) {
  std::vector<std::uint8_t> grey;

  // Five pixels of 10 bits: four upper bytes, the lower bits, and the next group.
  unpack_upper_bytes(std::vector<std::uint8_t>{1, 2, 3, 4, 0xff, 5, 9, 9, 6, 7, 8, 9, 0xff, 10}, 5,
                     2, 8, 4, grey);
  EXPECT_EQ(grey, (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10}));

  unpack_upper_bytes(std::vector<std::uint8_t>{1, 2, 0xff, 3, 4, 0xff}, 4, 1, 6, 2, grey);
  EXPECT_EQ(grey, (std::vector<std::uint8_t>{1, 2, 3, 4}));
}

}  // namespace
}  // namespace crepes::libcamera_camera_test
