/// The interface of cameras, and their frames.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/sensor_totals.hpp"
#include "drivers/camera/camera_light.hpp"
#include "estimator/core/result.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// An image in a buffer of the device. The destructor returns the buffer to the device, on any
/// thread. The device's memory remains valid until then.
using BorrowedPixels =
    std::unique_ptr<const std::uint8_t, std::function<void(const std::uint8_t*)>>;

/// One grey image; moved from owner to owner.
struct Frame {
  Timestamp stamp{};        ///< when the shutter was open
  Timestamp arrival{};      ///< when the image was received
  std::uint8_t camera = 0;  ///< index into the configured cameras
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels = {};  ///< row by row, width * height grey levels
  BorrowedPixels borrowed = {};           ///< instead of `pixels`: the image in the device's buffer
  std::ptrdiff_t borrowed_stride = 0;     ///< bytes from row to row of what is borrowed

  /// The first grey level.
  [[nodiscard]] const std::uint8_t* data() const {
    return borrowed ? borrowed.get() : pixels.data();
  }
  /// Bytes from row to row.
  [[nodiscard]] std::ptrdiff_t stride() const { return borrowed ? borrowed_stride : width; }
};

/// The diagnosis of a camera whose exposure leaves no time for its frame rate.
inline constexpr const char* kExposureTooLong =
    "the exposure is longer than a frame at rate_hz: set exposure_us";

class Camera {
 public:
  Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;
  Camera(Camera&&) = delete;
  Camera& operator=(Camera&&) = delete;
  virtual ~Camera() = default;

  /// The next frame; the newest if several wait; empty if none arrives within `timeout`. An error
  /// ends the stream: open the camera again.
  [[nodiscard]] virtual Result<std::optional<Frame>> read_once(
      std::chrono::milliseconds timeout) = 0;

  /// Accepts a used frame of this camera, pixels unchanged, so that its memory can be reused.
  /// Optional.
  // NOLINTNEXTLINE(performance-unnecessary-value-param): overrides move from it.
  virtual void recycle(Frame /*frame*/) {}

  /// Changes exposure and gain while frames arrive. An error leaves the stream as it was.
  [[nodiscard]] virtual Result<void> set_light(const CameraLight& /*light*/) {
    return fail(ErrorCode::kConfig, "this camera has no exposure to set");
  }

  /// Frames missed, late or broken, and other counts.
  [[nodiscard]] virtual SensorTotals counters() const = 0;

  /// One sentence on what is wrong with a camera that still delivers frames, if anything.
  [[nodiscard]] virtual std::optional<std::string> diagnosis() const { return std::nullopt; }
};

/// A camera that is available.
struct FoundCamera {
  std::string device;       ///< the value for the configuration
  std::string description;  ///< for people
};

}  // namespace crepes
