/// Draws the results into a picture.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// A recognized robot, its position and its trail.
struct DrawnRobot {
  RobotId id{};
  std::string name;
  std::vector<Eigen::Vector2d> trail_px;  ///< oldest first; the last one is the current position
};

/// Writes a PNG: circles around spots, names at robots, their trails, `caption` at the top.
[[nodiscard]] Result<void> draw_spots(const Frame& frame, std::span<const Spot> spots,
                                      std::span<const DrawnRobot> robots,
                                      const std::string& caption,
                                      const std::filesystem::path& file);

}  // namespace crepes
