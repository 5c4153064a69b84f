/// The measurement model of ranges between the UWB antennas.
#pragma once

#include <optional>

#include "estimator/relative/error_state.hpp"
#include "estimator/relative/kalman_update.hpp"

namespace crepes {

using RangeInnovation = Innovation<1, ErrorState::kSeen>;

/// Linearizes  z = | p_B_N + R_B_N p_N_Q - p_B_U | + b  at `state`, with `p_B_U` and `p_N_Q` the
/// antennas. Empty when the antennas nearly coincide: the gradient is undefined there.
[[nodiscard]] std::optional<RangeInnovation> linearize_range(const NominalState& state,
                                                             const Eigen::Vector3d& p_B_U,
                                                             const Eigen::Vector3d& p_N_Q,
                                                             double range_m, double sigma_m);

}  // namespace crepes
