/// What a recording for `calibrate camera` has shown so far, and what it lacks.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "estimator/core/result.hpp"
#include "estimator/vision/blink_tracker.hpp"

namespace crepes {

/// Counts where in the picture identified boards were seen and for how long, and how the body
/// turned at that time. A guess of the lens is sufficient.
class CameraCoverage {
 public:
  static constexpr int kRows = 10;
  static constexpr int kColumns = 16;

  /// Of the configuration's first camera.
  [[nodiscard]] static Result<CameraCoverage> of(const Config& config);

  void add(const ImuSample& sample);
  void add(const SpotFrame& frame);

  /// Whether light can fall on this cell: its center is in the circle that touches the nearer
  /// border of the picture, or no further out than a cell that was seen.
  [[nodiscard]] bool is_inside(int row, int column) const;
  /// Whether a board was seen there several times.
  [[nodiscard]] bool is_seen(int row, int column) const;
  /// The share of the cells inside that were seen.
  [[nodiscard]] double picture() const;
  /// Root mean square about each axis of the body.
  [[nodiscard]] Eigen::Vector3d rate_rms_radps() const;
  /// The time in which boards were seen.
  [[nodiscard]] double seen_s() const { return seen_s_; }
  [[nodiscard]] const std::set<RobotId>& boards() const { return boards_; }

  /// Progress of the requirement that is furthest from being met, 0 to 1. With 1 the recording is
  /// expected to be sufficient.
  [[nodiscard]] double share() const;
  /// What to do, one sentence each; empty with a share of 1.
  [[nodiscard]] std::vector<std::string> missing() const;

 private:
  CameraCoverage(const CameraCalibration& camera, const CameraModel& model,
                 const IdLibrary& library, const Config& config);

  /// Of a cell's center, from the picture's.
  [[nodiscard]] double radius_px(int row, int column) const;
  /// Of a quarter of the picture: the first or second half of the rows and columns.
  [[nodiscard]] double picture_of(bool is_low, bool is_right) const;

  CameraCalibration camera_;
  CameraModel model_;
  BlinkTracker tracker_;
  std::array<std::array<int, kColumns>, kRows> sightings_{};
  double farthest_px_ = 0.0;  ///< radius of the outermost cell that was seen
  std::set<RobotId> boards_;
  std::optional<Timestamp> last_seen_;
  double seen_s_ = 0.0;
  Eigen::Vector3d rate_square_sum_ = Eigen::Vector3d::Zero();
  double samples_ = 0.0;
};

/// For a terminal: the picture's cells, the turns, a bar, and what is missing.
[[nodiscard]] std::string coverage_text(const CameraCoverage& coverage);
/// The same as one JSON line. `cells` has a string for each row of the picture: a hash for a cell
/// that was seen, a dot for one that was not yet, a blank outside the image circle.
[[nodiscard]] std::string coverage_json(const CameraCoverage& coverage);

}  // namespace crepes
