/// The part of the MindVision library's C interface that this project uses.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

/// The library's description of a connected camera; texts are null-terminated.
struct MindVisionDevice {
  std::array<char, 32> series;
  std::array<char, 32> product;
  std::array<char, 32> friendly_name;
  std::array<char, 32> link;
  std::array<char, 32> driver;
  std::array<char, 32> sensor;
  std::array<char, 32> port;
  std::array<char, 32> serial_number;
  std::uint32_t instance;
};
static_assert(sizeof(MindVisionDevice) == 260);

/// The library's frame header.
struct MindVisionFrame {
  std::uint32_t media_type;
  std::uint32_t bytes;
  std::int32_t width;
  std::int32_t height;
  std::int32_t zoom_width;
  std::int32_t zoom_height;
  std::uint32_t is_trigger;
  std::uint32_t timestamp;  ///< [0.1 ms]
  std::uint32_t exposure_us;
  float gain;
  std::array<std::uint32_t, 6> processing;
};
static_assert(sizeof(MindVisionFrame) == 64);

/// The functions of the library. Each returns 0 or an error code.
struct MindVisionLibrary {
  static constexpr std::uint32_t kMono8 = 0x01080001;
  static constexpr int kTimeOut = -12;   ///< no frame within the timeout
  static constexpr int kLostData = -26;  ///< an incomplete frame

  /// Loads the file, once in the process. The error says what to install.
  [[nodiscard]] static Result<MindVisionLibrary> load(const std::string& file);

  int (*init)(int language) = nullptr;
  int (*enumerate)(MindVisionDevice* devices, int* count) = nullptr;
  int (*open)(MindVisionDevice* device, int mode, int team, int* handle) = nullptr;
  int (*play)(int handle) = nullptr;
  int (*get_frame)(int handle, MindVisionFrame* frame, std::uint8_t** pixels,
                   std::uint32_t timeout_ms) = nullptr;
  int (*release_frame)(int handle, std::uint8_t* pixels) = nullptr;
  int (*close)(int handle) = nullptr;
  int (*set_auto_exposure)(int handle, int on) = nullptr;
  int (*set_exposure_us)(int handle, double exposure_us) = nullptr;
  int (*set_frame_rate)(int handle, int rate_hz) = nullptr;
  int (*set_trigger_mode)(int handle, int mode) = nullptr;
};

}  // namespace crepes
