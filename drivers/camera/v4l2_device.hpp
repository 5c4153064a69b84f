/// The system calls on a video device.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// An open device; the destructor closes it. Thread-safe.
class V4l2Device {
 public:
  V4l2Device() = default;
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;
  V4l2Device(V4l2Device&&) = delete;
  V4l2Device& operator=(V4l2Device&&) = delete;
  virtual ~V4l2Device() = default;

  /// ioctl(2). Returns 0 or errno.
  [[nodiscard]] virtual int ioctl(unsigned long code, void* argument) = 0;
  /// Maps a buffer of the device for the lifetime of this object; empty on failure.
  [[nodiscard]] virtual std::span<const std::uint8_t> map(std::size_t length,
                                                          std::size_t offset) = 0;
  /// Whether a frame or an error is available within `timeout`.
  [[nodiscard]] virtual bool wait(std::chrono::milliseconds timeout) = 0;
};

[[nodiscard]] Result<std::unique_ptr<V4l2Device>> open_v4l2_device(const std::string& path);

/// The devices in `dev` that capture frames, by their persistent links where they have one.
[[nodiscard]] std::vector<FoundCamera> find_v4l2_cameras(const std::filesystem::path& dev);

}  // namespace crepes
