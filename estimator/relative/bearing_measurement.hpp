/// The measurement model of bearings: the camera of one robot, the LED ring of the other.
#pragma once

#include <optional>

#include "estimator/relative/error_state.hpp"
#include "estimator/relative/kalman_update.hpp"

namespace crepes {

using BearingInnovation = Innovation<2, ErrorState::kSeen>;

/// Linearizes  u = Exp(m_B) d / |d|,  d = p_B_N + R_B_N p_N_M - p_B_C,  in the plane across the
/// predicted direction. `p_N_M` is the neighbor's LED ring, `p_B_C` our camera.
/// Empty where ring and camera nearly coincide or the bearing points the other way.
[[nodiscard]] std::optional<BearingInnovation> linearize_bearing(const NominalState& state,
                                                                 const Eigen::Vector3d& u_B,
                                                                 const Eigen::Vector3d& p_B_C,
                                                                 const Eigen::Vector3d& p_N_M,
                                                                 double sigma_rad);

/// The same from the neighbor's side:  u = Exp(m_N) d / |d|,  d = R_B_N^T (p_B_M - p_B_N) - p_N_C.
/// `p_B_M` is our LED ring, `p_N_C` the neighbor's camera.
[[nodiscard]] std::optional<BearingInnovation> linearize_peer_bearing(const NominalState& state,
                                                                      const Eigen::Vector3d& u_N,
                                                                      const Eigen::Vector3d& p_N_C,
                                                                      const Eigen::Vector3d& p_B_M,
                                                                      double sigma_rad);

}  // namespace crepes
