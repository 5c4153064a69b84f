#include "drivers/camera/aravis_settings.hpp"

#include <fmt/format.h>

#include <string>

#include "drivers/camera/aravis_call.hpp"

namespace crepes {
namespace {

/// Whether the camera has a feature; false if the query fails.
template <class Ask>
bool has(Ask ask, ArvCamera* camera) {
  return call_aravis("", [&](GError** e) { return ask(camera, e); }).value_or(0) != 0;
}

Result<void> set_pixel_format(ArvCamera* camera) {
  return call_aravis(
             "pixel format Mono8",
             [&](GError** e) { arv_camera_set_pixel_format(camera, ARV_PIXEL_FORMAT_MONO_8, e); })
      .map_error([&](Error error) {
        guint count = 0;
        const char** names =
            arv_camera_dup_available_pixel_formats_as_strings(camera, &count, nullptr);
        error.message += "; the camera offers";
        for (guint i = 0; i < count; ++i) error.message += fmt::format(" {}", names[i]);
        g_free(names);
        return error;
      });
}

Result<void> set_region(ArvCamera* camera, const CameraConfig& config) {
  const int width = config.calibration.resolution[0];
  const int height = config.calibration.resolution[1];
  const int x = config.device.offset[0];
  const int y = config.device.offset[1];
  const auto described_as = [](int a, int b, int c, int d) {
    return fmt::format("[{}, {}] at offset [{}, {}]", a, b, c, d);
  };
  const std::string wanted = fmt::format("resolution {}", described_as(width, height, x, y));
  int sensor_width = 0;
  int sensor_height = 0;
  int is_width = 0;
  int is_height = 0;
  int is_x = 0;
  int is_y = 0;
  const auto apply = [&](GError** e) {
    arv_camera_get_sensor_size(camera, &sensor_width, &sensor_height, e);
    if (*e == nullptr && x + width <= sensor_width && y + height <= sensor_height)
      arv_camera_set_region(camera, x, y, width, height, e);
    if (*e == nullptr) arv_camera_get_region(camera, &is_x, &is_y, &is_width, &is_height, e);
  };
  if (Result<void> applied = call_aravis(wanted, apply); !applied) return applied;
  if (is_x == x && is_y == y && is_width == width && is_height == height) return {};
  return fail(ErrorCode::kConfig,
              fmt::format("{}: the camera, of {} x {} pixels, delivers {}", wanted, sensor_width,
                          sensor_height, described_as(is_width, is_height, is_x, is_y)));
}

Result<void> set_trigger(ArvCamera* camera, const CameraConfig& config) {
  if (config.device.trigger == CameraTrigger::kHardware) {
    return call_aravis(fmt::format("trigger_source {}", config.device.trigger_source),
                       [&](GError** e) {
                         arv_camera_set_trigger(camera, config.device.trigger_source.c_str(), e);
                       });
  }
  static_cast<void>(
      call_aravis("", [&](GError** e) { arv_camera_clear_triggers(camera, e); }));  // may have none
  return call_aravis("rate_hz", [&](GError** e) {
    arv_camera_set_frame_rate(camera, config.calibration.rate_hz, e);
  });
}

/// Whether the camera is on loopback, where a packet socket receives nothing.
bool is_loopback(ArvCamera* camera) {
  GSocketAddress* address =
      arv_gv_device_get_device_address(ARV_GV_DEVICE(arv_camera_get_device(camera)));
  return g_inet_address_get_is_loopback(
             g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address))) != 0;
}

Result<void> set_packets(ArvCamera* camera, int packet_size) {
  if (arv_camera_is_gv_device(camera) == 0) return {};
  if (is_loopback(camera))
    arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  if (packet_size == 0) return {};
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  return call_aravis("packet_size",
                     [&](GError** e) { arv_camera_gv_set_packet_size(camera, packet_size, e); });
}

}  // namespace

Result<void> set_aravis_light(ArvCamera* camera, const CameraLight& light) {
  if (light.exposure_us) {
    const auto set = [&](GError** e) {
      if (has(arv_camera_is_exposure_auto_available, camera))
        arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, e);
      if (*e == nullptr) arv_camera_set_exposure_time(camera, *light.exposure_us, e);
    };
    if (Result<void> done = call_aravis("exposure_us", set); !done) return done;
  }
  if (!light.gain) return {};
  return call_aravis("gain", [&](GError** e) {
    if (has(arv_camera_is_gain_auto_available, camera))
      arv_camera_set_gain_auto(camera, ARV_AUTO_OFF, e);
    if (*e == nullptr) arv_camera_set_gain(camera, *light.gain, e);
  });
}

Result<void> configure_aravis(ArvCamera* camera, const CameraConfig& config) {
  // A program that crashed may have left the stream running.
  static_cast<void>(call_aravis("", [&](GError** e) { arv_camera_stop_acquisition(camera, e); }));
  return set_pixel_format(camera)
      .and_then([&] { return set_region(camera, config); })
      .and_then([&] {
        return call_aravis("acquisition mode", [&](GError** e) {
          arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, e);
        });
      })
      .and_then([&] { return set_trigger(camera, config); })
      .and_then([&] { return set_aravis_light(camera, config.device.light); })
      .and_then([&] { return set_packets(camera, config.device.packet_size); });
}

}  // namespace crepes
