/// Lights that are expected where the poses of robots have their boards.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>

#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/expected_board.hpp"

namespace crepes {

/// Where a board is, by the pose of its robot, with the phase in which it was blinking.
struct ExpectedLight {
  CodeMatch match;
  Timestamp phase_learned{};
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();
  double sigma_rad = 0.0;

  /// Other lights so near make it ambiguous.
  [[nodiscard]] double reach_rad() const;
};

/// The direction of a board from the camera.
struct BoardDirection {
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();  ///< at the stamp of the board
  double sigma_rad = 0.0;                          ///< per axis across the direction
};

/// The direction in which a camera at `p_B_C` [m] sees the board at `stamp`, in the axes of the
/// body at the board's own stamp, some 20 ms before. Empty if it is too uncertain.
[[nodiscard]] std::optional<BoardDirection> direction_of(const ExpectedBoard& board,
                                                         const Eigen::Vector3d& p_B_C,
                                                         Timestamp stamp);

/// The expected light of `code`, if it is about where the code was seen, at `seen_B`: a mirror
/// image of the board is elsewhere. Null without one.
[[nodiscard]] const ExpectedLight* find_near(std::span<const ExpectedLight> expected,
                                             std::size_t code, const Eigen::Vector3d& seen_B);

}  // namespace crepes
