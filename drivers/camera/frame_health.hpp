/// Frames that are not what a camera was set to deliver, and a camera that repeats itself.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "estimator/core/config.hpp"

namespace crepes {

/// Looks at every frame in order. Pure.
class FrameHealth {
 public:
  explicit FrameHealth(const CameraConfig& config);

  /// An error where the camera must be opened anew: another resolution, or the same picture for a
  /// second.
  [[nodiscard]] Result<void> check(const Frame& frame);

  /// One sentence on what is wrong with a stream that can be used, if anything.
  [[nodiscard]] std::optional<std::string> diagnosis() const;

 private:
  [[nodiscard]] bool repeats_the_last(const Frame& frame);
  void note_gap(Duration gap);

  std::array<int, 2> resolution_;
  double rate_hz_;
  bool is_free_running_;

  std::optional<Timestamp> last_stamp_;
  double mean_gap_s_;
  std::uint64_t gaps_ = 0;

  Timestamp unchanged_since_{};
  std::vector<std::uint8_t> some_rows_;  ///< of the last picture
  std::vector<std::uint8_t> all_rows_;   ///< of the last picture, if its some_rows_ repeated
};

}  // namespace crepes
