/// The measurement models of ranges between the UWB antennas, and of distances by the ring's size.
#pragma once

#include <optional>

#include "estimator/relative/error_state.hpp"
#include "estimator/relative/kalman_update.hpp"

namespace crepes {

/// What all distances by the size of a ring have in common, one sigma, relative: its radius as
/// configured and built, the scale of the lens, where in its package an LED shines.
inline constexpr double kRingScaleSigma = 0.03;

using RangeInnovation = Innovation<1, ErrorState::kSeen>;

/// Linearizes  z = | p_B_N + R_B_N p_N_Q - p_B_U | + b  at `state`, with `p_B_U` and `p_N_Q` the
/// antennas. Empty when the antennas nearly coincide: the gradient is undefined there.
[[nodiscard]] std::optional<RangeInnovation> linearize_range(const NominalState& state,
                                                             const Eigen::Vector3d& p_B_U,
                                                             const Eigen::Vector3d& p_N_Q,
                                                             double range_m, double sigma_m);

/// The same without a bias: z = | p_B_N + R_B_N p_N_M - p_B_C |, with `p_B_C` the camera and
/// `p_N_M` the LED ring.
[[nodiscard]] std::optional<RangeInnovation> linearize_ring_distance(const NominalState& state,
                                                                     const Eigen::Vector3d& p_B_C,
                                                                     const Eigen::Vector3d& p_N_M,
                                                                     double distance_m,
                                                                     double sigma_m);

}  // namespace crepes
