/// Persistent names of devices: finds a serial device again after it was unplugged.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace crepes {

/// The directory of udev's persistent links to serial devices.
inline constexpr const char* kSerialById = "/dev/serial/by-id";

/// The link in `by_id` that refers to `device`.
[[nodiscard]] std::optional<std::string> by_id_link_of(const std::string& device,
                                                       const std::filesystem::path& by_id);

/// The process that has `device` open, as "name (id)"; empty if none is visible.
[[nodiscard]] std::optional<std::string> process_using(const std::string& device);

/// The path of a configured device. After the device was open once, the same device is found again
/// even if the kernel has given it another name.
class DeviceName {
 public:
  DeviceName(std::string configured, std::filesystem::path by_id)
      : configured_(std::move(configured)), by_id_(std::move(by_id)) {}

  /// Another device from now on, unless this one is configured already.
  void configure(const std::string& configured);
  [[nodiscard]] std::string path_to_open() const;
  /// Call when `path_to_open()` has been opened.
  void remember_link();

 private:
  std::string configured_;
  std::filesystem::path by_id_;
  std::optional<std::string> by_id_link_;
};

}  // namespace crepes
