/// What one robot measures of another: a spot in its picture, and a range.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "estimator/calibration/swarm/swarm_state.hpp"

namespace crepes {

/// A body at one instant; world z is up.
struct BodyAt {
  Eigen::Quaterniond q_W_B = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
};

/// Columns of a sighting's Jacobian: both bodies [theta (right), p], then the observer's lens,
/// R_C_B (right) and p_B_C, then the other's ring.
namespace sighting_columns {
inline constexpr int kObserver = 0;
inline constexpr int kOther = 6;
inline constexpr int kCamera = 12;
inline constexpr int kRing = 24;
inline constexpr int kSize = 27;
}  // namespace sighting_columns

/// The predicted pixel of another robot's ring, and its derivative.
struct SightingFactor {
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();  ///< predicted [px]
  Eigen::Matrix<double, 2, sighting_columns::kSize> J;
};

/// Where `observer`'s camera shows the ring of `other`. Empty where the lens has no projection.
[[nodiscard]] std::optional<Eigen::Vector2d> predicted_spot(const RobotConstants& observer,
                                                            const BodyAt& observer_at,
                                                            const RobotConstants& other,
                                                            const BodyAt& other_at);
[[nodiscard]] std::optional<SightingFactor> linearize_sighting(const RobotConstants& observer,
                                                               const BodyAt& observer_at,
                                                               const RobotConstants& other,
                                                               const BodyAt& other_at);

/// Columns of a range's Jacobian: both bodies [theta (right), p], both antennas, both delays.
namespace range_columns {
inline constexpr int kObserver = 0;
inline constexpr int kOther = 6;
inline constexpr int kAntenna = 12;
inline constexpr int kOtherAntenna = 15;
inline constexpr int kDelay = 18;
inline constexpr int kOtherDelay = 19;
inline constexpr int kSize = 20;
}  // namespace range_columns

/// The predicted range between two robots, and its derivative.
struct RangeFactor {
  double range_m = 0.0;  ///< predicted
  Eigen::Matrix<double, 1, range_columns::kSize> J;
};

/// | p_W_Q - p_W_U | + both delays. Empty where the antennas nearly coincide.
[[nodiscard]] std::optional<RangeFactor> linearize_antenna_range(const RobotConstants& observer,
                                                                 const BodyAt& observer_at,
                                                                 const RobotConstants& other,
                                                                 const BodyAt& other_at);

}  // namespace crepes
