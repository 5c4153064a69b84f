#include "drivers/camera/mindvision_camera.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include "tests/support/counted.hpp"
#include "tests/support/manual_clock.hpp"

extern "C" {
#include "tests/support/mindvision_stub/mindvision_stub.h"
}

namespace crepes::mindvision_camera_test {
namespace {

using namespace std::chrono_literals;

/// With the stand-in for the vendor's library, as it was before any test.
class MindVisionCameraTest : public testing::Test {
 protected:
  void SetUp() override {
    void* library = ::dlopen(CREPES_MINDVISION_STUB, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    ASSERT_NE(library, nullptr) << ::dlerror();
    stub_ = static_cast<mindvision_stub*>(::dlsym(library, "mindvision_stub"));
    ASSERT_NE(stub_, nullptr);
    static const mindvision_stub kFresh = *stub_;
    *stub_ = kFresh;
    config_.device.library = CREPES_MINDVISION_STUB;
    config_.calibration.resolution = {64, 48};
    config_.calibration.rate_hz = 200;
    config_.device.light.exposure_us = 400;
    config_.device.latency_ms = 3.0;
    clock_.set(Timestamp{10s});
  }

  Result<std::unique_ptr<Camera>> open() { return open_mindvision_camera(config_, 2, clock_); }
  std::string open_error() {
    const auto camera = open();
    return camera ? "" : camera.error().message;
  }
  static std::string read_error(Camera& camera) {
    const auto frame = camera.read_once(10ms);
    return frame ? "" : frame.error().message;
  }

  mindvision_stub* stub_ = nullptr;
  CameraConfig config_;
  ManualClock clock_;
};

TEST_F(MindVisionCameraTest, SaysWhatToInstallWhereTheLibraryIsAbsent) {
  config_.device.library = "libnosuch.so";

  const std::string reported = open_error();

  EXPECT_NE(reported.find("install the vendor's SDK"), std::string::npos) << reported;
  EXPECT_NE(reported.find("libnosuch.so"), std::string::npos) << reported;
}

TEST_F(MindVisionCameraTest, RefusesAnotherLibrary) {
  config_.device.library = "libm.so.6";

  EXPECT_EQ(open_error(), "libm.so.6: no library of MindVision, CameraSdkInit is not in it");
}

TEST_F(MindVisionCameraTest, SetsTheCameraUpAndClosesIt) {
  {
    const auto camera = open();
    ASSERT_TRUE(camera) << camera.error().message;
    EXPECT_EQ(stub_->open_handles, 1);
    EXPECT_EQ(stub_->trigger_mode, 0);
    EXPECT_EQ(stub_->rate_hz, 200);
    EXPECT_EQ(stub_->auto_exposure, 0);
    EXPECT_EQ(stub_->set_exposure_us, 400);
  }
  EXPECT_EQ(stub_->open_handles, 0);
}

TEST_F(MindVisionCameraTest, WaitsForHardwarePulsesIfSoConfigured) {
  config_.device.trigger = CameraTrigger::kHardware;

  const auto camera = open();

  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(stub_->trigger_mode, 2);
}

TEST_F(MindVisionCameraTest, LendsFramesAndGivesTheirBuffersBack) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  stub_->timestamp = 77;
  stub_->waiting = 1;
  {
    const auto frame = (*camera)->read_once(10ms);

    ASSERT_TRUE(frame && *frame);
    EXPECT_EQ((*frame)->width, 64);
    EXPECT_EQ((*frame)->height, 48);
    EXPECT_EQ((*frame)->camera, 2);
    EXPECT_EQ((*frame)->stamp, Timestamp{10s} - 3ms);
    EXPECT_EQ((*frame)->data()[64 * 48 - 1], 77);
    EXPECT_EQ(stub_->lent_buffers, 1);
  }
  EXPECT_EQ(stub_->lent_buffers, 0);
}

TEST_F(MindVisionCameraTest, HandsOnTheNewestAndGivesBackTheOthers) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  stub_->timestamp = 0;
  stub_->waiting = 3;

  const auto frame = (*camera)->read_once(10ms);

  ASSERT_TRUE(frame && *frame);
  EXPECT_EQ(*(*frame)->data(), 100);
  EXPECT_EQ(stub_->lent_buffers, 1);
  EXPECT_EQ(counts_of(**camera, "superseded"), 2U);
}

TEST_F(MindVisionCameraTest, KeepsTheCameraOpenForAsLongAsAFrameIsAway) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  stub_->waiting = 1;
  auto frame = (*camera)->read_once(10ms);
  ASSERT_TRUE(frame && *frame);

  camera->reset();
  EXPECT_EQ(stub_->open_handles, 1);
  frame->reset();

  EXPECT_EQ(stub_->open_handles, 0);
  EXPECT_EQ(stub_->lent_buffers, 0);
  EXPECT_EQ(stub_->releases_after_close, 0);
}

TEST_F(MindVisionCameraTest, TakesATimeOutForNoFrameAndOtherCodesForTheEnd) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;

  const auto nothing = (*camera)->read_once(10ms);
  stub_->frame_code = -38;
  const std::string reported = read_error(**camera);

  EXPECT_TRUE(nothing && !*nothing);
  EXPECT_EQ(reported, "the camera is gone: the library's error -38");
}

TEST_F(MindVisionCameraTest, CountsFramesThatComeInPart) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  stub_->frame_code = -26;

  const auto nothing = (*camera)->read_once(10ms);

  EXPECT_TRUE(nothing && !*nothing);
  EXPECT_EQ(faults_of(**camera, "incomplete"), 1U);
}

TEST_F(MindVisionCameraTest, RefusesFramesThatAreNotGreyOrShorterThanTheyClaim) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  stub_->waiting = 1;
  stub_->media_type = 0x01080009;
  EXPECT_NE(read_error(**camera).find("instead of MONO8"), std::string::npos);

  stub_->waiting = 1;
  stub_->media_type = 0x01080001;
  stub_->short_by = 1;
  EXPECT_EQ(read_error(**camera), "frames shorter than they claim");

  EXPECT_EQ(stub_->lent_buffers, 0);
}

TEST_F(MindVisionCameraTest, ReportsAnExposureThatIsLongerThanAFrame) {
  auto camera = open();
  ASSERT_TRUE(camera) << camera.error().message;
  stub_->waiting = 1;
  stub_->exposure_us = 6000;

  ASSERT_TRUE((*camera)->read_once(10ms));

  EXPECT_NE((*camera)->diagnosis().value_or("").find("exposure"), std::string::npos);
}

TEST_F(MindVisionCameraTest, FindsACameraByItsSerialNumber) {
  stub_->cameras = 3;
  EXPECT_EQ(open_error(), "several cameras: set device to one of MV1, MV2, MV3");
  config_.device.id = "MV9";
  EXPECT_EQ(open_error(), "MV9: no such camera; there is MV1, MV2, MV3");
  config_.device.id = "MV2";
  EXPECT_EQ(open_error(), "");
  stub_->cameras = 0;
  EXPECT_EQ(open_error(), "no MindVision camera");
  stub_->enumerate_code = -16;
  EXPECT_EQ(open_error(), "no camera found: the library's error -16");
}

TEST_F(MindVisionCameraTest, ClosesACameraThatCannotBeSetUp) {
  stub_->exposure_code = -43;

  EXPECT_EQ(open_error(), "exposure_us: the library's error -43");

  EXPECT_EQ(stub_->open_handles, 0);
  stub_->open_code = -45;
  EXPECT_EQ(open_error(), "camera MV1: the library's error -45");
}

}  // namespace
}  // namespace crepes::mindvision_camera_test
