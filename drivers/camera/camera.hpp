/// Where pictures come from.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/core/result.hpp"
#include "estimator/core/sensor_totals.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// A device's memory with a picture in it. Its end gives the memory back to the device, on whatever
/// thread that is, and keeps the device's memory alive until then.
using LentPixels = std::unique_ptr<const std::uint8_t, std::function<void(const std::uint8_t*)>>;

/// One grey picture; moved from owner to owner.
struct Frame {
  Timestamp stamp{};        ///< when the shutter was open
  Timestamp arrival{};      ///< when the picture was here
  std::uint8_t camera = 0;  ///< index into the configured cameras
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels = {};  ///< row by row, width * height grey levels
  LentPixels lent = {};  ///< in place of `pixels`: the picture lies where the device put it
  std::ptrdiff_t lent_stride = 0;  ///< bytes from row to row of what is lent

  /// The first grey level.
  [[nodiscard]] const std::uint8_t* data() const { return lent ? lent.get() : pixels.data(); }
  /// Bytes from row to row.
  [[nodiscard]] std::ptrdiff_t stride() const { return lent ? lent_stride : width; }
};

class Camera {
 public:
  Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;
  Camera(Camera&&) = delete;
  Camera& operator=(Camera&&) = delete;
  virtual ~Camera() = default;

  /// The next frame, or nothing when none came within `timeout`; when several wait, the newest. An
  /// error ends the stream: open the camera anew.
  [[nodiscard]] virtual Result<std::optional<Frame>> read_once(
      std::chrono::milliseconds timeout) = 0;

  /// Takes back a frame of this camera that has been used, pixels unchanged, to save the next its
  /// memory. Optional.
  // NOLINTNEXTLINE(performance-unnecessary-value-param): overrides move from it.
  virtual void recycle(Frame /*frame*/) {}

  /// Frames missed, late, broken, and what else there is to count.
  [[nodiscard]] virtual SensorTotals counters() const = 0;

  /// One sentence on what is wrong with a camera that delivers nonetheless, if anything.
  [[nodiscard]] virtual std::optional<std::string> diagnosis() const { return std::nullopt; }
};

/// A camera that could be opened.
struct FoundCamera {
  std::string device;       ///< what to write into the configuration
  std::string description;  ///< for people
};

}  // namespace crepes
