#include "daemon/ctl/setup/devices.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "daemon/ctl/json_line.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/libcamera_device.hpp"
#include "drivers/camera/v4l2_device.hpp"
#include "drivers/detect_protocol.hpp"
#include "drivers/serial/serial_port.hpp"
#include "drivers/serial/serial_reader.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Fastest first: at a wrong rate a line looks like noise.
constexpr std::array kRates{921600, 460800, 115200};

SerialDevice listen_to(const std::string& path, std::chrono::milliseconds duration) {
  const MonotonicClock clock;
  for (const int baud : kRates) {
    Result<SerialPort> port = SerialPort::open(path, baud);
    if (!port) return {path, 0, std::nullopt, port.error().message};
    RecentBytes recent;
    for (const Timestamp end = clock.now() + duration; clock.now() < end;) {
      const Result<Bytes> chunk = port->read_some(std::chrono::milliseconds(20));
      if (!chunk) return {path, 0, std::nullopt, chunk.error().message};
      recent.add(*chunk);
    }
    if (const auto spoken = detect_protocol(recent.get())) return {path, baud, spoken, ""};
  }
  return {path, 0, std::nullopt, ""};
}

std::vector<SerialDevice> find_serial_devices(const DevicesOptions& options) {
  std::vector<SerialDevice> found;
  std::error_code failed;  // the directory is missing if no device is plugged in
  for (const auto& link : fs::directory_iterator(options.dev / "serial" / "by-id", failed))
    found.push_back(listen_to(link.path(), options.listen));
  std::ranges::sort(found, {}, &SerialDevice::port);
  return found;
}

std::vector<CameraDevice> find_cameras(const DevicesOptions& options) {
  std::vector<CameraDevice> cameras;
  for (FoundCamera& found : find_aravis_cameras()) cameras.push_back({"aravis", std::move(found)});
  for (FoundCamera& found : find_v4l2_cameras(options.dev))
    cameras.push_back({"v4l2", std::move(found)});
  for (FoundCamera& found : find_libcamera_cameras())
    cameras.push_back({"libcamera", std::move(found)});
  return cameras;
}

std::string text_of(const CameraDevice& camera) {
  return fmt::format("{}\n    cameras: [{{name: cam0, driver: {}, device: \"{}\"}}]\n",
                     camera.found.description, camera.driver, camera.found.device);
}

std::string text_of(const SerialDevice& device) {
  if (!device.fault.empty()) return fmt::format("{}\n    {}\n", device.port, device.fault);
  if (!device.speaks) {
    return fmt::format("{}\n    says nothing that is known at {}, {} or {} baud\n", device.port,
                       kRates[0], kRates[1], kRates[2]);
  }
  const std::string section = is_of_uwb(*device.speaks) ? "uwb" : "imu";
  return fmt::format("{0}\n    speaks {1}\n    {2}: {{port: \"{0}\", baud: {3}}}\n", device.port,
                     name_of(*device.speaks), section, device.baud);
}

std::string text_of(const FoundIioImu& imu) {
  const auto& [gyro, accelerometer] = imu.devices;
  const std::string names =
      gyro.id == accelerometer.id ? gyro.title() : gyro.title() + ", " + accelerometer.title();
  return fmt::format("{}\n    imu: {{protocol: iio, port: \"{}\"}}\n", names, imu.port);
}

Json json_of(const FoundIioImu& imu) {
  return {{"port", imu.port},
          {"gyroscope", imu.devices.gyro.name},
          {"accelerometer", imu.devices.accelerometer.name}};
}

Json json_of(const CameraDevice& camera) {
  return {{"driver", camera.driver},
          {"device", camera.found.device},
          {"description", camera.found.description}};
}

Json json_of(const SerialDevice& device) {
  Json json{{"port", device.port}};
  if (!device.fault.empty()) json["fault"] = device.fault;
  if (!device.speaks) return json;
  json["speaks"] = name_of(*device.speaks);
  json["baud"] = device.baud;
  return json;
}

}  // namespace

ConnectedDevices find_devices(const DevicesOptions& options) {
  return {.cameras = find_cameras(options),
          .serial = find_serial_devices(options),
          .kernel_imus = find_iio_imus(options.iio)};
}

Result<std::string> list_devices(const DevicesOptions& options) {
  const auto [cameras, serial, kernel_imus] = find_devices(options);
  if (options.json) {
    Json json{{"cameras", Json::array()},
              {"serial_ports", Json::array()},
              {"kernel_imus", Json::array()}};
    for (const auto& camera : cameras) json["cameras"].push_back(json_of(camera));
    for (const auto& device : serial) json["serial_ports"].push_back(json_of(device));
    for (const auto& imu : kernel_imus) json["kernel_imus"].push_back(json_of(imu));
    return json_line(json);
  }
  std::string text = cameras.empty() ? "no camera\n" : "";
  for (const auto& camera : cameras) text += text_of(camera);
  if (serial.empty()) text += "no serial port\n";
  for (const auto& device : serial) text += text_of(device);
  for (const auto& imu : kernel_imus) text += text_of(imu);
  return text;
}

}  // namespace crepes
