/// Scenes of LED boards in front of one camera, and what detector and tracker make of them.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sim/board_renderer.hpp"
#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/swarm_config.hpp"
#include "estimator/vision/vision_config.hpp"

namespace crepes::study {

/// Four boards of a library of 64, a fisheye of 1280x1024 at 200 Hz and a gyro.
struct VisionScene {
  std::string name;
  LedBoard board{};
  PictureEffects effects{};
  double nearest_m = 2.0;
  double farthest_m = 6.0;
  double peak_rate_dps = 30.0;  ///< the camera's yaw, to and fro
  double turns_hz = 0.25;
  double tilt_rad = 0.6;    ///< at most, of the boards
  bool do_cross = false;    ///< boards pass within 3 px of each other
  bool is_foreign = false;  ///< boards blink codes of another library
  double lost_share = 0.0;  ///< of the frames, in bursts of 8
  double duration_s = 4.0;
  double score_from_s = 1.0;
  std::uint64_t seed = 1;
  SpotDetectorKind detector = SpotDetectorKind::kFast;
  /// Whether the board is hidden; no one is if this is empty.
  std::function<bool(std::size_t board, double t_s)> is_hidden{};
};

/// The camera of all scenes, with the shutter of these effects.
[[nodiscard]] CameraCalibration scene_camera(const PictureEffects& effects);

/// Counted from `score_from_s` on, but wrong and astray bearings from the start.
struct VisionScore {
  std::size_t lit = 0;          ///< boards in frames
  std::size_t identified = 0;   ///< of them with a bearing within 2 px
  std::size_t predicted = 0;    ///< of these named before they were read
  std::size_t wrong = 0;        ///< bearings of another board's light
  std::size_t astray = 0;       ///< bearings more than 2 px from every board
  std::size_t false_spots = 0;  ///< spots away from every board
  std::size_t pictures = 0;
  std::size_t returns = 0;  ///< boards that appeared after they were hidden
  std::size_t unnamed_returns =
      0;                          ///< of them without a bearing in the first frame that shows them
  std::size_t never = 0;          ///< boards that were never identified
  double board_s = 0.0;           ///< boards times seconds, from the start
  double slowest_s = 0.0;         ///< light that the slowest board showed before its first bearing
  std::vector<double> errors_px;  ///< of right bearings
  std::vector<double> peaks;      ///< of boards' brightest pixels, above the background

  [[nodiscard]] double right_percent() const;
  void add(const VisionScore& other);
};

[[nodiscard]] VisionScore score_vision(const VisionScene& scene);

/// The scenes of the study. What moves, blinks and hides in them is drawn from `seed`.
[[nodiscard]] std::vector<VisionScene> vision_scenes(std::uint64_t seed);

/// Boards in single pictures, one each.
struct RingPictures {
  std::vector<int> leds;
  std::vector<double> radii_m;
  bool is_square = false;
  double nearest_m = 0.4;
  double farthest_m = 1.6;
  double tilt_rad = 1.22;
  double veil = 0.0;
  int pictures = 300;
  unsigned seed = 11;
};

struct RingScore {
  int pictures = 0;
  int one_spot = 0;                     ///< exactly one
  int centered = 0;                     ///< exactly one, within a pixel
  std::vector<double> distance_errors;  ///< by the rings' sizes, relative; where there is one
};

[[nodiscard]] RingScore score_rings(const RingPictures& rings);

}  // namespace crepes::study
