/// Where pictures come from.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "estimator/core/result.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// One grey picture; moved from owner to owner.
struct Frame {
  Timestamp stamp{};        ///< when the shutter was open
  std::uint8_t camera = 0;  ///< index into the configured cameras
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;  ///< row by row, width * height grey levels
};

class Camera {
 public:
  Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;
  Camera(Camera&&) = delete;
  Camera& operator=(Camera&&) = delete;
  virtual ~Camera() = default;

  /// The next frame, or nothing when none came within `timeout`. An error ends the stream: open
  /// the camera anew.
  [[nodiscard]] virtual Result<std::optional<Frame>> read_once(
      std::chrono::milliseconds timeout) = 0;

  /// Takes back a frame of this camera that has been used, pixels unchanged, to save the next its
  /// memory. Optional.
  // NOLINTNEXTLINE(performance-unnecessary-value-param): overrides move from it.
  virtual void recycle(Frame /*frame*/) {}

  /// Totals by reason: frames missed, late, broken.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::uint64_t>> counters() const = 0;
};

}  // namespace crepes
