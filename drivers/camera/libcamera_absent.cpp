/// In place of libcamera_device.cpp, where the program is built without libcamera.
#include "drivers/camera/libcamera_device.hpp"

namespace crepes {

Result<std::unique_ptr<LibcameraDevice>> open_libcamera_device(const CameraConfig& /*config*/) {
  return fail(ErrorCode::kConfig,
              "built without libcamera: install libcamera-dev, build with -DCREPES_LIBCAMERA=ON");
}

std::vector<FoundCamera> find_libcamera_cameras() { return {}; }

}  // namespace crepes
