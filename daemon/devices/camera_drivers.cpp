#include "daemon/devices/camera_drivers.hpp"

#include <utility>

#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/image_folder.hpp"
#include "drivers/camera/libcamera_camera.hpp"
#include "drivers/camera/mindvision_camera.hpp"
#include "drivers/camera/v4l2_camera.hpp"
#include "drivers/camera/watched_camera.hpp"

namespace crepes {
namespace {

Result<std::unique_ptr<Camera>> open_device(const CameraConfig& camera, std::uint8_t index,
                                            const Clock& clock) {
  switch (camera.device.driver) {
    case CameraDriver::kAravis:
      return open_aravis_camera(camera, index, clock);
    case CameraDriver::kV4l2:
      return open_v4l2_camera(camera, index, clock);
    case CameraDriver::kLibcamera:
      return open_libcamera_camera(camera, index, clock);
    case CameraDriver::kMindVision:
      return open_mindvision_camera(camera, index, clock);
    default:
      return fail(ErrorCode::kConfig, "no device: set driver of camera " + camera.calibration.name);
  }
}

}  // namespace

OpenCamera real_camera(const Config& config, std::size_t index, const Clock& clock) {
  const auto number = static_cast<std::uint8_t>(index);
  return [configured = config.cameras[index], number,
          &clock](const CameraLight& light) -> Result<std::unique_ptr<Camera>> {
    CameraConfig camera = configured;
    camera.device.light = light;
    if (camera.device.driver == CameraDriver::kFolder)
      return FolderCamera::open(camera.device.folder, camera.calibration, number, clock);
    Result<std::unique_ptr<Camera>> opened = open_device(camera, number, clock);
    if (!opened) return opened;
    return std::make_unique<WatchedCamera>(std::move(*opened), camera, clock);
  };
}

}  // namespace crepes
