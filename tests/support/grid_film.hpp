/// A film of a grid of LEDs by a camera that a hand moves, with the body's inertial samples.
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/calibration/grid/grid_camera.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes::simulated {

/// A grid that leans back, 0.7 m before a hand that moves by 0.2 m.
inline std::vector<Eigen::Vector3d> grid_places(const GridShape& shape) {
  const Eigen::Vector3d along_columns = shape.pitch_m * Eigen::Vector3d(0.0, -1.0, 0.0);
  const Eigen::Vector3d along_rows = shape.pitch_m * Eigen::Vector3d(0.28, 0.0, -0.96);
  std::vector<Eigen::Vector3d> places;
  for (int row = 0; row < shape.rows; ++row)
    for (int column = 0; column < shape.columns; ++column)
      places.emplace_back(Eigen::Vector3d(0.7, 0.15, 0.1) + row * along_rows +
                          column * along_columns);
  return places;
}

/// Ten pictures a second.
inline HandHeld grid_in_hand(const GridShape& shape, double duration_s) {
  return {.duration_s = duration_s,
          .camera_rate_hz = 10.0,
          .noise_px = 0.1,
          .dark_share = 0.01,
          .places = grid_places(shape)};
}

/// The lights of each picture of a recording.
inline std::vector<GridFrame> frames_of(const CameraRecording& recording) {
  std::vector<GridFrame> frames;
  for (const BoardSighting& sighting : recording.sightings) {
    if (frames.empty() || frames.back().stamp != sighting.stamp)
      frames.push_back({sighting.stamp, {}});
    frames.back().lights.push_back(sighting.uv);
  }
  return frames;
}

}  // namespace crepes::simulated
