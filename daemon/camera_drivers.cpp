#include "daemon/camera_drivers.hpp"

#include "drivers/camera/image_folder.hpp"

namespace crepes {

OpenCamera real_camera(const Config& config, std::size_t index, const Clock& clock) {
  const CameraConfig camera = config.cameras[index];
  const auto number = static_cast<std::uint8_t>(index);
  return [camera, number, &clock]() -> Result<std::unique_ptr<Camera>> {
    if (camera.driver == CameraDriver::kFolder)
      return FolderCamera::open(camera.folder, number, clock);
    return fail(ErrorCode::kConfig, "no device: set driver of camera " + camera.name);
  };
}

}  // namespace crepes
