/// Detects frames with a wrong resolution or rate, and a camera that repeats its images.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/camera_config.hpp"

namespace crepes {

/// Receives every frame in order. Pure.
class FrameHealth {
 public:
  explicit FrameHealth(const CameraConfig& config);

  /// An error if the camera must be opened again: another resolution, or the same image for a
  /// second.
  [[nodiscard]] Result<void> check(const Frame& frame);

  /// One sentence on what is wrong with a usable stream, if anything.
  [[nodiscard]] std::optional<std::string> diagnosis() const;

 private:
  [[nodiscard]] bool repeats_the_last(const Frame& frame);
  void record_interval(Duration gap);

  std::array<int, 2> resolution_;
  double rate_hz_;
  bool is_free_running_;

  std::optional<Timestamp> last_stamp_;
  double mean_gap_s_;
  std::uint64_t gaps_ = 0;

  Timestamp unchanged_since_{};
  std::vector<std::uint8_t> some_rows_;  ///< of the last image
  std::vector<std::uint8_t> all_rows_;   ///< of the last image, if its some_rows_ repeated
};

}  // namespace crepes
