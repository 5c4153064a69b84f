#include "drivers/iio/iio_devices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <system_error>

#include "drivers/serial/text_line.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

bool measures(const IioAttributes& device, std::string_view quantity) {
  return device.has(fmt::format("in_{}_x_raw", quantity)) ||
         device.has(fmt::format("scan_elements/in_{}_x_en", quantity));
}

IioDevice device_at(const fs::path& folder) {
  const IioAttributes attributes(folder);
  return {.id = folder.filename(),
          .name = attributes.text("name").value_or("nameless"),
          .label = attributes.text("label").value_or(""),
          .attributes = attributes,
          .measures_rate = measures(attributes, "anglvel"),
          .measures_acceleration = measures(attributes, "accel")};
}

bool is_named(const IioDevice& device, std::string_view word) {
  const std::string_view id = word.starts_with("/dev/") ? word.substr(5) : word;
  return id == device.id || device.name.starts_with(word) ||
         (!device.label.empty() && device.label == word);
}

std::vector<std::string_view> words_of(std::string_view port) {
  std::vector<std::string_view> words;
  for (const std::string_view part : parts_of(port, ',')) {
    for (const std::string_view word : parts_of(part, ' '))
      if (!word.empty()) words.push_back(word);
  }
  return words;
}

std::string titles_of(const std::vector<IioDevice>& devices) {
  std::string titles;
  for (const IioDevice& device : devices) titles += (titles.empty() ? "" : ", ") + device.title();
  return titles;
}

tl::unexpected<Error> none(const IioPaths& paths, std::string_view what, std::string_view port) {
  return fail(ErrorCode::kNotFound,
              fmt::format("no {} {}in {}; is its driver loaded?", what,
                          port.empty() ? "" : fmt::format("that imu.port names ({}) ", port),
                          paths.devices.string()));
}

/// The gyroscope's own accelerometer: in the same device, or of the same chip.
std::optional<IioDevice> own_accelerometer(const IioDevice& gyro,
                                           const std::vector<IioDevice>& accelerometers) {
  if (gyro.measures_acceleration) return gyro;
  std::vector<IioDevice> own;
  for (const IioDevice& device : accelerometers)
    if (chip_of(device.name) == chip_of(gyro.name)) own.push_back(device);
  if (own.size() == 1) return own.front();
  return accelerometers.size() == 1 ? std::optional(accelerometers.front()) : std::nullopt;
}

}  // namespace

std::vector<IioDevice> find_iio_devices(const IioPaths& paths) {
  std::vector<IioDevice> found;
  std::error_code failed;  // the folder is missing if the kernel has no IIO
  fs::directory_iterator entry(paths.devices, failed);
  for (; !failed && entry != fs::directory_iterator(); entry.increment(failed)) {
    if (!entry->path().filename().string().starts_with("iio:device")) continue;
    const IioDevice device = device_at(entry->path());
    if (device.measures_rate || device.measures_acceleration) found.push_back(device);
  }
  std::ranges::sort(found, {}, &IioDevice::id);
  return found;
}

std::string_view chip_of(std::string_view name) {
  constexpr std::array<std::string_view, 4> kKinds{"gyro", "accel", "imu", "anglvel"};
  const std::size_t at = name.find_last_of("-_");
  if (at == std::string_view::npos) return name;
  return std::ranges::find(kKinds, name.substr(at + 1)) == kKinds.end() ? name : name.substr(0, at);
}

Result<IioImuDevices> choose_iio_imu(const IioPaths& paths, std::string_view port) {
  const std::vector<std::string_view> words = words_of(port);
  std::vector<IioDevice> gyros;
  std::vector<IioDevice> accelerometers;
  for (const IioDevice& device : find_iio_devices(paths)) {
    const auto names_it = [&](std::string_view word) { return is_named(device, word); };
    if (!words.empty() && std::ranges::none_of(words, names_it)) continue;
    if (device.measures_rate) gyros.push_back(device);
    if (device.measures_acceleration) accelerometers.push_back(device);
  }
  if (gyros.empty()) return none(paths, "gyroscope", port);
  if (accelerometers.empty()) return none(paths, "accelerometer", port);
  if (gyros.size() > 1) {
    return fail(ErrorCode::kConfig,
                fmt::format("several gyroscopes: {}; name one in imu.port", titles_of(gyros)));
  }
  const auto own = own_accelerometer(gyros.front(), accelerometers);
  if (own) return IioImuDevices{gyros.front(), *own};
  return fail(
      ErrorCode::kConfig,
      fmt::format("several accelerometers: {}; name the gyroscope and one of them in imu.port",
                  titles_of(accelerometers)));
}

std::vector<FoundIioImu> find_iio_imus(const IioPaths& paths) {
  std::vector<IioDevice> gyros;
  std::vector<IioDevice> accelerometers;
  for (const IioDevice& device : find_iio_devices(paths)) {
    if (device.measures_rate) gyros.push_back(device);
    if (device.measures_acceleration) accelerometers.push_back(device);
  }
  std::vector<FoundIioImu> found;
  for (const IioDevice& gyro : gyros) {
    const auto own = own_accelerometer(gyro, accelerometers);
    if (!own) continue;
    std::string port(chip_of(gyro.name));
    if (!choose_iio_imu(paths, port))
      port = own->id == gyro.id ? gyro.id : fmt::format("{}, {}", gyro.id, own->id);
    found.push_back({port, {gyro, *own}});
  }
  return found;
}

}  // namespace crepes
