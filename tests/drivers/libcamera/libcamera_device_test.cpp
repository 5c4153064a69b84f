#include "drivers/camera/libcamera_device.hpp"

#include <gtest/gtest.h>

namespace crepes::libcamera_device_test {
namespace {

// libcamera itself, on whatever machine this is: most have no camera that it knows.
TEST(LibcameraDevice, NamesACameraThatIsNotThere) {
  CameraConfig config;
  config.device.id = "/base/soc/no/such/sensor@1a";

  const auto device = open_libcamera_device(config);

  ASSERT_FALSE(device);
  EXPECT_EQ(device.error().code, ErrorCode::kNotFound);
  const std::vector<FoundCamera> found = find_libcamera_cameras();
  if (found.empty()) {
    EXPECT_EQ(device.error().message, "libcamera finds no camera");
  }
  for (const FoundCamera& camera : found)
    EXPECT_NE(device.error().message.find(camera.device), std::string::npos);
}

}  // namespace
}  // namespace crepes::libcamera_device_test
