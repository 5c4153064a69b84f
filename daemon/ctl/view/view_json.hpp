/// What the page receives: poses as rows of numbers, and events. Pure.
#pragma once

#include <string>
#include <string_view>

#include "estimator/core/outputs.hpp"

namespace crepes {

/// t, mode (0 direct, 1 graph, 2 predicted), p_B_N x y z [m], q_B_N w x y z, the covariance of p as
/// xx xy xz yy yz zz [m^2], the largest sigma of p [m] and of theta [rad], age_s, reset_counter.
/// `t_s` is the time that the page shows. Empty if a number is not finite.
[[nodiscard]] std::string pose_row(double t_s, const NeighborPose& pose);

/// t, p_B_N x y z, q_B_N w x y z.
[[nodiscard]] std::string truth_row(double t_s, const Pose& T_B_N);

/// x, y, z.
[[nodiscard]] std::string vector_row(const Eigen::Vector3d& v);

/// An event of a stream of server-sent events; `json` is one line.
[[nodiscard]] std::string stream_event(std::string_view name, std::string_view json);

}  // namespace crepes
