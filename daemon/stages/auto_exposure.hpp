/// Holds a camera's exposure where all boards in view can be read; pure.
#pragma once

#include <map>
#include <optional>
#include <span>

#include "drivers/camera/camera_light.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// The gray levels that a picture is judged by.
struct PictureLevels {
  double background = 0.0;
  double threshold = 0.0;  ///< from which a pixel belongs to a spot
};

/// The brightest board stays below white, unless the faintest would then come too near to the
/// threshold: a board that is white is still found, one below the threshold is not.
///
/// `exposure_us` of the settings is the longest exposure, so blur has a bound. A board too far for
/// a shorter one is not in view while others are near: the longest is tried again every 15 s, for
/// as long as it takes to read an ID. Lamps count for nothing, only boards that are identified do.
class AutoExposure {
 public:
  explicit AutoExposure(const LightSettings& settings);

  /// The boards that were identified in one picture.
  void add(std::span<const Bearing> boards);

  /// After each picture. Returns the exposure [us] from now on, where it changes.
  [[nodiscard]] std::optional<double> step(Timestamp now, const PictureLevels& levels);

  /// The present exposure [us]; empty where none is chosen here.
  [[nodiscard]] std::optional<double> exposure_us() const;
  /// The longest that may be chosen [us].
  [[nodiscard]] double longest_us() const { return longest_us_; }

 private:
  [[nodiscard]] double factor(const PictureLevels& levels) const;
  [[nodiscard]] double least_factor(const PictureLevels& levels) const;
  [[nodiscard]] double next_exposure(Timestamp now, const PictureLevels& levels);

  bool is_active_ = false;
  double longest_us_ = 0.0;
  double exposure_us_ = 0.0;
  std::map<RobotId, double> peaks_;  ///< the largest of each board in the window
  std::optional<Timestamp> window_end_;
  Timestamp next_trial_ = kNever;     ///< of the longest exposure
  std::optional<double> resumed_us_;  ///< during a trial: the exposure before it
};

}  // namespace crepes
