#include "drivers/camera/v4l2_camera.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <deque>
#include <map>
#include <set>

#include "drivers/camera/grey_conversion.hpp"
#include "tests/support/counted.hpp"
#include "tests/support/manual_clock.hpp"

namespace crepes::v4l2_camera_test {
namespace {

using namespace std::chrono_literals;

/// The behaviour of the device in a test, and the requests that it received.
struct FakeKernel {
  std::uint32_t abilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::set<std::uint32_t> formats{V4L2_PIX_FMT_GREY};
  std::uint32_t width = 32;
  std::uint32_t height = 20;
  std::uint32_t padding = 0;  ///< bytes after each row
  std::map<unsigned long, int> errors;
  std::map<std::uint32_t, int> controls{{V4L2_CID_EXPOSURE_ABSOLUTE, 50}};
  double rate_hz = 0.0;
  std::optional<v4l2_rect> crop;  ///< empty: it has none

  std::vector<std::vector<std::uint8_t>> memory;
  std::deque<std::uint32_t> free;
  std::deque<v4l2_buffer> filled;
  std::uint32_t sequence = 0;
  bool is_running = false;
  bool is_open = false;

  /// The device takes a picture with this byte everywhere.
  bool shoot(std::uint8_t level, std::uint32_t flags = 0, Timestamp at = {}) {
    ++sequence;
    if (free.empty()) return false;
    v4l2_buffer buffer{};
    buffer.index = free.front();
    buffer.sequence = sequence;
    buffer.flags = flags;
    buffer.timestamp.tv_sec = to_ns(at) / 1'000'000'000;
    buffer.timestamp.tv_usec = to_ns(at) / 1000 % 1'000'000;
    free.pop_front();
    std::ranges::fill(memory[buffer.index], level);
    buffer.bytesused = static_cast<std::uint32_t>(memory[buffer.index].size());
    filled.push_back(buffer);
    return true;
  }
};

class FakeDevice final : public V4l2Device {
 public:
  explicit FakeDevice(FakeKernel& kernel) : kernel_(kernel) { kernel_.is_open = true; }
  FakeDevice(const FakeDevice&) = delete;
  FakeDevice& operator=(const FakeDevice&) = delete;
  FakeDevice(FakeDevice&&) = delete;
  FakeDevice& operator=(FakeDevice&&) = delete;
  ~FakeDevice() override { kernel_.is_open = false; }

  [[nodiscard]] int ioctl(unsigned long code, void* argument) override {
    if (const auto error = kernel_.errors.find(code); error != kernel_.errors.end())
      return error->second;
    switch (code) {
      case VIDIOC_QUERYCAP:
        static_cast<v4l2_capability*>(argument)->capabilities = kernel_.abilities;
        return 0;
      case VIDIOC_S_FMT:
        return set_format(static_cast<v4l2_format*>(argument)->fmt.pix);
      case VIDIOC_S_PARM: {
        const auto& period = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
        kernel_.rate_hz = static_cast<double>(period.denominator) / period.numerator;
        return 0;
      }
      case VIDIOC_S_CTRL:
        return set_control(*static_cast<v4l2_control*>(argument));
      case VIDIOC_G_CTRL: {
        auto& control = *static_cast<v4l2_control*>(argument);
        if (!kernel_.controls.contains(control.id)) return EINVAL;
        control.value = kernel_.controls[control.id];
        return 0;
      }
      case VIDIOC_REQBUFS: {
        auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
        wanted.count = 4;
        kernel_.memory.assign(4, std::vector<std::uint8_t>(size_));
        return 0;
      }
      case VIDIOC_QUERYBUF: {
        auto& buffer = *static_cast<v4l2_buffer*>(argument);
        buffer.length = size_;
        buffer.m.offset = buffer.index;
        return 0;
      }
      case VIDIOC_QBUF:
        kernel_.free.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_DQBUF:
        if (kernel_.filled.empty()) return EAGAIN;
        *static_cast<v4l2_buffer*>(argument) = kernel_.filled.front();
        kernel_.filled.pop_front();
        return 0;
      case VIDIOC_G_SELECTION:
        if (!kernel_.crop) return ENOTTY;
        static_cast<v4l2_selection*>(argument)->r = {0, 0, kernel_.width, kernel_.height};
        return 0;
      case VIDIOC_S_SELECTION:
        if (!kernel_.crop) return ENOTTY;
        kernel_.crop = static_cast<v4l2_selection*>(argument)->r;
        return 0;
      case VIDIOC_STREAMON:
        kernel_.is_running = true;
        return 0;
      default:
        return ENOTTY;
    }
  }

  [[nodiscard]] std::span<const std::uint8_t> map(std::size_t length, std::size_t offset) override {
    return std::span(kernel_.memory[offset]).first(length);
  }
  [[nodiscard]] bool wait(std::chrono::milliseconds) override {
    return !kernel_.filled.empty() || kernel_.errors.contains(VIDIOC_DQBUF);
  }

 private:
  int set_format(v4l2_pix_format& format) {
    if (!kernel_.formats.contains(format.pixelformat))
      format.pixelformat = kernel_.formats.empty() ? V4L2_PIX_FMT_MJPEG : *kernel_.formats.begin();
    format.width = kernel_.width;
    format.height = kernel_.height;
    const std::uint32_t bytes = format.pixelformat == V4L2_PIX_FMT_GREY ? 1 : 2;
    format.bytesperline = bytes * format.width + kernel_.padding;
    size_ = format.bytesperline * format.height;
    return 0;
  }
  int set_control(const v4l2_control& control) {
    const auto known = kernel_.controls.find(control.id);
    if (known == kernel_.controls.end()) return EINVAL;
    known->second = control.value;
    return 0;
  }

  FakeKernel& kernel_;
  std::uint32_t size_ = 0;
};

class V4l2CameraTest : public testing::Test {
 protected:
  void SetUp() override {
    config_.device.id = "/dev/video7";
    config_.calibration.resolution = {32, 20};
    config_.calibration.rate_hz = 100;
    config_.device.latency_ms = 4.0;
    clock_.set(Timestamp{100s});
  }

  Result<std::unique_ptr<Camera>> open() {
    return start_v4l2_camera(std::make_unique<FakeDevice>(kernel_), config_, 1, clock_);
  }
  std::string open_error() {
    const auto camera = open();
    return camera ? "" : camera.error().message;
  }

  FakeKernel kernel_;
  CameraConfig config_;
  ManualClock clock_;
};

TEST_F(V4l2CameraTest, BorrowsGreyFramesWithTheirStrideAndRequeuesTheBuffers) {
  kernel_.padding = 32;
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_TRUE(kernel_.is_running);
  EXPECT_EQ(kernel_.rate_hz, 100);
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(kernel_.shoot(static_cast<std::uint8_t>(i)));

    const auto frame = (*camera)->read_once(10ms);

    ASSERT_TRUE(frame && *frame);
    EXPECT_TRUE((*frame)->pixels.empty());
    EXPECT_EQ((*frame)->stride(), 64);
    EXPECT_EQ((*frame)->width, 32);
    EXPECT_EQ(*(*frame)->data(), i);
    EXPECT_EQ(kernel_.free.size(), 3U);
  }
  EXPECT_EQ(kernel_.free.size(), 4U);
  EXPECT_EQ(faults_of(**camera, "missed"), 0U);
}

TEST_F(V4l2CameraTest, NarrowsWiderLevelsAndUsesTheirMemoryAgain) {
  kernel_.formats = {V4L2_PIX_FMT_Y10};
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  ASSERT_TRUE(kernel_.shoot(0x02));  // 0x0202 of 10 bits

  auto frame = (*camera)->read_once(10ms);

  ASSERT_TRUE(frame && *frame);
  EXPECT_EQ((*frame)->pixels, std::vector<std::uint8_t>(32 * 20, 0x0202 >> 2));
  EXPECT_EQ(kernel_.free.size(), 4U);
  const std::uint8_t* memory = (*frame)->data();
  (*camera)->recycle(std::move(**frame));
  ASSERT_TRUE(kernel_.shoot(0x01));
  frame = (*camera)->read_once(10ms);
  ASSERT_TRUE(frame && *frame);
  EXPECT_EQ((*frame)->data(), memory);
}

TEST_F(V4l2CameraTest, ReturnsTheNewestAndCountsSkippedAndMissedFrames) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  for (int i = 1; i <= 6; ++i) kernel_.shoot(static_cast<std::uint8_t>(i));  // four buffers

  const auto frame = (*camera)->read_once(10ms);

  ASSERT_TRUE(frame && *frame);
  EXPECT_EQ(*(*frame)->data(), 4);
  EXPECT_EQ(counts_of(**camera, "superseded"), 3U);
  ASSERT_TRUE(kernel_.shoot(7));
  ASSERT_TRUE((*camera)->read_once(10ms));
  EXPECT_EQ(faults_of(**camera, "missed"), 2U);
}

TEST_F(V4l2CameraTest, RequeuesBrokenFrames) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  kernel_.shoot(1, V4L2_BUF_FLAG_ERROR);
  kernel_.shoot(2);
  kernel_.filled.back().bytesused -= 1;

  const auto frame = (*camera)->read_once(10ms);

  EXPECT_TRUE(frame && !*frame);
  EXPECT_EQ(faults_of(**camera, "incomplete"), 2U);
  EXPECT_EQ(kernel_.free.size(), 4U);
}

TEST_F(V4l2CameraTest, StampsAsTheKernelDoesWhereThatIsPlausible) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  const auto stamp_of = [&](std::uint32_t flags, Timestamp at) {
    EXPECT_TRUE(kernel_.shoot(1, flags, at));
    const auto frame = (*camera)->read_once(10ms);
    return frame && *frame ? (*frame)->stamp : Timestamp{};
  };

  EXPECT_EQ(stamp_of(V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, Timestamp{99990ms}),
            Timestamp{99990ms} - 4ms);
  EXPECT_EQ(stamp_of(V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, Timestamp{200s}), Timestamp{100s} - 4ms);
  EXPECT_EQ(stamp_of(V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, Timestamp{3s}), Timestamp{100s} - 4ms);
  EXPECT_EQ(stamp_of(V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, Timestamp{99990ms}), Timestamp{100s} - 4ms);
}

TEST_F(V4l2CameraTest, ReportsThatTheDeviceIsGone) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  kernel_.errors[VIDIOC_DQBUF] = ENODEV;

  const auto frame = (*camera)->read_once(10ms);

  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().message, "/dev/video7: the camera is gone: No such device");
}

TEST_F(V4l2CameraTest, KeepsTheDeviceOpenForAsLongAsAFrameIsAway) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  kernel_.shoot(1);
  auto frame = (*camera)->read_once(10ms);
  ASSERT_TRUE(frame && *frame);

  camera->reset();
  EXPECT_TRUE(kernel_.is_open);
  frame->reset();

  EXPECT_FALSE(kernel_.is_open);
}

TEST_F(V4l2CameraTest, RefusesADeviceThatOffersSomethingElse) {
  kernel_.width = 640;
  EXPECT_EQ(
      open_error(),
      "/dev/video7: no GREY, Y16, Y12 or Y10 of [32, 20]; the device offers GREY of [640, 20]");
  kernel_.formats.clear();
  EXPECT_EQ(
      open_error(),
      "/dev/video7: no GREY, Y16, Y12 or Y10 of [32, 20]; the device offers MJPG of [640, 20]");
  kernel_.abilities = V4L2_CAP_VIDEO_OUTPUT;
  EXPECT_EQ(open_error(), "/dev/video7: a video device that captures no frames");
  EXPECT_FALSE(kernel_.is_open);
}

TEST_F(V4l2CameraTest, RefusesSettingsThatTheDeviceDoesNotHave) {
  config_.device.light.gain = 3;
  EXPECT_EQ(open_error(), "/dev/video7: gain: Invalid argument");
  config_.device.light.gain.reset();
  config_.device.offset = {8, 0};
  EXPECT_NE(open_error().find("offset"), std::string::npos);
}

TEST_F(V4l2CameraTest, UndoesTheCropOfAnEarlierRun) {
  kernel_.crop = v4l2_rect{100, 50, 32, 20};

  ASSERT_TRUE(open());

  EXPECT_EQ(kernel_.crop->left, 0);
  EXPECT_EQ(kernel_.crop->top, 0);
}

TEST_F(V4l2CameraTest, SetsTheExposureAndReportsOneLongerThanAFrame) {
  config_.device.light.exposure_us = 700;
  {
    const auto camera = open();
    ASSERT_TRUE(camera) << camera.error().message;
    EXPECT_EQ(kernel_.controls[V4L2_CID_EXPOSURE_ABSOLUTE], 7);
    EXPECT_EQ((*camera)->diagnosis(), std::nullopt);
  }
  config_.device.light.exposure_us.reset();
  kernel_.controls[V4L2_CID_EXPOSURE_ABSOLUTE] = 101;
  const auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_NE((*camera)->diagnosis().value_or("").find("exposure"), std::string::npos);
}

TEST_F(V4l2CameraTest, ChangesTheExposureWhileItRuns) {
  config_.device.light.exposure_us = 700;
  const auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;

  ASSERT_TRUE((*camera)->set_light({.exposure_us = 10100.0, .gain = {}}));
  EXPECT_EQ(kernel_.controls[V4L2_CID_EXPOSURE_ABSOLUTE], 101);
  EXPECT_NE((*camera)->diagnosis().value_or("").find("exposure"), std::string::npos);
  ASSERT_TRUE((*camera)->set_light({.exposure_us = 300.0, .gain = {}}));
  EXPECT_EQ(kernel_.controls[V4L2_CID_EXPOSURE_ABSOLUTE], 3);
  EXPECT_EQ((*camera)->diagnosis(), std::nullopt);

  const auto refused = (*camera)->set_light({.exposure_us = {}, .gain = 3.0});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "/dev/video7: gain: Invalid argument");
}

TEST(V4l2Device, NamesAMissingFile) {
  const auto device = open_v4l2_device("/dev/video99");

  ASSERT_FALSE(device);
  EXPECT_EQ(device.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(device.error().message, "/dev/video99: No such file or directory");
}

TEST(GreyConversion, KeepsTheUpperEightBitsOfEachRow) {
  const std::vector<std::uint8_t> rows{0xff, 0x03, 0x00, 0x02, 9, 9, 0x04, 0x00, 0xff, 0xff};
  std::vector<std::uint8_t> grey;

  narrow_to_8_bits(rows, 2, 2, 6, 10, grey);

  EXPECT_EQ(grey, (std::vector<std::uint8_t>{255, 128, 1, 255}));
}

TEST(GreyConversion, KeepsTheHighByteOfSixteenBits) {
  std::vector<std::uint8_t> grey;

  narrow_to_8_bits(std::vector<std::uint8_t>{0x34, 0x12, 0xff, 0xff}, 2, 1, 4, 16, grey);

  EXPECT_EQ(grey, (std::vector<std::uint8_t>{0x12, 0xff}));
}

}  // namespace
}  // namespace crepes::v4l2_camera_test
