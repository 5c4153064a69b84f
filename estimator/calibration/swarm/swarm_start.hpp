/// The first guess of a swarm's calibration: where the estimator of one robot had the others.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/calibration/swarm/swarm_problem.hpp"
#include "estimator/calibration/swarm/swarm_state.hpp"
#include "estimator/core/pose.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// A robot as the reference robot estimated it, in the reference's body.
struct EstimatedPose {
  Timestamp stamp{};
  Pose T_B_N;
  Eigen::Vector3d v_B_N = Eigen::Vector3d::Zero();  ///< R_W_B^T (v_W_N - v_W_B) [m/s]
};

/// The direction of up in the reference's body.
struct EstimatedUp {
  Timestamp stamp{};
  Eigen::Vector3d up_B = Eigen::Vector3d::UnitZ();
};

/// Stamps are those of the records.
struct SwarmStart {
  std::size_t reference = 0;
  std::vector<std::vector<EstimatedPose>> poses;  ///< by robot and stamp; the reference has none
  std::vector<EstimatedUp> up;                    ///< by stamp
};

/// Attitudes from gravity and the reference's gyroscope; the reference stays at the origin. A robot
/// without a pose is carried by its gyroscope where it was.
[[nodiscard]] SwarmState first_state(const SwarmProblem& problem,
                                     const std::vector<RobotConstants>& guess,
                                     const SwarmStart& start);

}  // namespace crepes
