/// The rows of DIR/<observer>/<neighbor>.csv and .tum. Numbers read back to the same bits.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// t_ns,t_pub_ns,mode,px,...,c20
[[nodiscard]] std::string_view pose_file_header();

/// Appends `pose` as one line. Numbers are the shortest that read back to the same bits.
void append_pose_row(std::string& text, const NeighborPose& pose);

/// Appends `t x y z qx qy qz qw`, the time in seconds with all its nanoseconds.
void append_tum_row(std::string& text, const NeighborPose& pose);

/// Reads a whole file of poses of `neighbor`; stamps must increase. Any bad row is an error. Fields
/// that a row does not contain (velocity, sources, ...) keep their defaults.
[[nodiscard]] Result<std::vector<NeighborPose>> read_pose_file(const std::filesystem::path& file,
                                                               RobotId neighbor);

}  // namespace crepes
