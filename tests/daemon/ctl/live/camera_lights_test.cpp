#include "daemon/ctl/live/camera_lights.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "config/reading/config_file.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "tests/support/places.hpp"

namespace crepes::camera_lights_test {
namespace {

namespace fs = std::filesystem;

class CameraLightsTest : public testing::Test {
 protected:
  CameraLightsTest() {
    fs::copy_file(source_dir() + "/config/examples/four-simulated/r1.yaml", config());
  }

  [[nodiscard]] fs::path config() const { return scratch_.path() / "crepesd.yaml"; }
  [[nodiscard]] fs::path fragment(const char* name) const {
    return scratch_.path() / "crepesd.d" / name;
  }
  [[nodiscard]] CameraLights lights() const { return CameraLights::load(config(), "").value(); }

  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
};

TEST_F(CameraLightsTest, WriteLightAndThresholdTogether) {
  ASSERT_TRUE(lights().change({.exposure_us = 321.0, .gain = {}}, 77));

  const auto changed = load_config(config());
  ASSERT_TRUE(changed) << changed.error().message;
  EXPECT_EQ(changed->cameras.front().device.light.exposure_us, 321.0);
  EXPECT_EQ(changed->vision.threshold, 77);
}

TEST_F(CameraLightsTest, WriteNothingIfAPartIsRefused) {
  EXPECT_FALSE(lights().change({.exposure_us = 321.0, .gain = {}}, 999));
  EXPECT_FALSE(fs::exists(fragment("90-exposure.yaml")));
  EXPECT_FALSE(fs::exists(fragment("90-threshold.yaml")));
}

TEST_F(CameraLightsTest, LeaveFormerFragmentsIfAPartIsRefused) {
  ASSERT_TRUE(lights().change({.exposure_us = 321.0, .gain = {}}, 77));

  EXPECT_FALSE(lights().change({.exposure_us = 400.0, .gain = {}}, 999));

  const auto left = load_config(config());
  ASSERT_TRUE(left) << left.error().message;
  EXPECT_EQ(left->cameras.front().device.light.exposure_us, 321.0);
  EXPECT_EQ(left->vision.threshold, 77);
}

}  // namespace
}  // namespace crepes::camera_lights_test
