/// Finding a serial device again after it was unplugged.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace crepes {

/// Where udev keeps a link to every serial device under a name that stays the same.
inline constexpr const char* kSerialById = "/dev/serial/by-id";

/// The link in `by_id` that points at `device`.
[[nodiscard]] std::optional<std::string> steady_name_of(const std::string& device,
                                                        const std::filesystem::path& by_id);

/// The program that has `device` open, as "name (process)"; empty where none can be seen.
[[nodiscard]] std::optional<std::string> holder_of(const std::string& device);

/// What to open for a configured device: its path, and once it has been open the same device,
/// whatever the kernel calls it now.
class DeviceName {
 public:
  DeviceName(std::string configured, std::filesystem::path by_id)
      : configured_(std::move(configured)), by_id_(std::move(by_id)) {}

  [[nodiscard]] std::string to_open() const;
  /// To be called when what `to_open` said is open.
  void remember();

 private:
  std::string configured_;
  std::filesystem::path by_id_;
  std::optional<std::string> steady_;
};

}  // namespace crepes
