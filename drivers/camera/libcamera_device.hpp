/// A camera of libcamera, as far as the driver needs it.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/camera_config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// How grey levels lie in a row of a buffer.
enum class GreyPacking : std::uint8_t {
  kBytes,     ///< a byte a pixel
  kWords,     ///< 16 bits a pixel, little-endian, the level in the lower ones
  kPacked10,  ///< MIPI CSI-2: the upper 8 bits of four pixels, then their lower bits in a fifth
              ///< byte
  kPacked12,  ///< MIPI CSI-2: the upper 8 bits of two pixels, then their lower bits in a third byte
};

/// A pixel format with grey levels, by libcamera's name.
struct GreyLayout {
  std::string_view name;
  GreyPacking packing = GreyPacking::kBytes;
  int bits = 8;        ///< of a level
  bool is_raw = true;  ///< the sensor's own levels; else the luminance of an image processor

  /// Bytes of a row of `width` pixels without padding.
  [[nodiscard]] constexpr std::size_t row_bytes(int width) const {
    const auto pixels = static_cast<std::size_t>(width);
    switch (packing) {
      case GreyPacking::kWords:
        return 2 * pixels;
      case GreyPacking::kPacked10:
        return (5 * pixels + 3) / 4;
      case GreyPacking::kPacked12:
        return (3 * pixels + 1) / 2;
      default:
        return pixels;
    }
  }
};

/// In the order of preference: levels in proportion to the light first, then what costs less.
inline constexpr std::array kGreyLayouts{
    GreyLayout{"R8"},
    GreyLayout{"R10_CSI2P", GreyPacking::kPacked10, 10},
    GreyLayout{"R12_CSI2P", GreyPacking::kPacked12, 12},
    GreyLayout{"R16", GreyPacking::kWords, 16},
    GreyLayout{"R12", GreyPacking::kWords, 12},
    GreyLayout{"R10", GreyPacking::kWords, 10},
    GreyLayout{"YUV420", GreyPacking::kBytes, 8, false},
    GreyLayout{"NV12", GreyPacking::kBytes, 8, false},
};

/// What a running camera delivers.
struct LibcameraStream {
  GreyLayout layout;
  int width = 0;
  int height = 0;
  std::size_t stride = 0;  ///< bytes from row to row
};

/// A completed frame, in one of the device's buffers.
struct LibcameraFrame {
  std::uint32_t buffer = 0;
  std::uint64_t sequence = 0;
  bool is_whole = true;
  std::optional<std::uint64_t> sensor_ns{};  ///< on CLOCK_BOOTTIME, when the first row was exposed
  double exposure_us = 0.0;                  ///< 0: unknown
};

/// A configured camera that is running; the destructor stops it. `requeue` may be called on any
/// thread, all else on one.
class LibcameraDevice {
 public:
  LibcameraDevice() = default;
  LibcameraDevice(const LibcameraDevice&) = delete;
  LibcameraDevice& operator=(const LibcameraDevice&) = delete;
  LibcameraDevice(LibcameraDevice&&) = delete;
  LibcameraDevice& operator=(LibcameraDevice&&) = delete;
  virtual ~LibcameraDevice() = default;

  [[nodiscard]] virtual const LibcameraStream& stream() const = 0;
  /// The rows of a buffer; valid for the lifetime of this object.
  [[nodiscard]] virtual std::span<const std::uint8_t> memory(std::uint32_t buffer) const = 0;
  /// The next frame, if one completes within `timeout`. An error: the camera is gone.
  [[nodiscard]] virtual Result<std::optional<LibcameraFrame>> next(
      std::chrono::milliseconds timeout) = 0;
  /// Gives a buffer back for a further frame.
  virtual void requeue(std::uint32_t buffer) = 0;
  /// Takes effect a few frames later.
  [[nodiscard]] virtual Result<void> set_light(const CameraLight& light) = 0;
};

/// Opens and starts the camera `config.device.id`, or the only one. An error where the program was
/// built without libcamera.
[[nodiscard]] Result<std::unique_ptr<LibcameraDevice>> open_libcamera_device(
    const CameraConfig& config);

/// The cameras that libcamera knows; none where the program was built without it.
[[nodiscard]] std::vector<FoundCamera> find_libcamera_cameras();

}  // namespace crepes
