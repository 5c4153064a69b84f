/// Smooth motions with exact derivatives.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "drivers/sim/velocity_lag.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/pose.hpp"

namespace crepes {

/// One coordinate over time: a line plus sines.
struct Wave {
  /// One sine of a wave.
  struct Sine {
    double amplitude;
    double omega_radps;
    double phase_rad;
  };
  double offset = 0.0;
  double slope_ps = 0.0;
  std::vector<Sine> sines{};

  /// The derivative of this order at time `t_s`; order 0 is the value.
  [[nodiscard]] double derivative(double t_s, int order) const;
};

/// The state of a body at one time.
struct BodyState {
  Pose T_W_B;
  Eigen::Vector3d v_W_B = Eigen::Vector3d::Zero();    ///< velocity [m/s], world axes
  Eigen::Vector3d a_W_B = Eigen::Vector3d::Zero();    ///< acceleration [m/s^2], world axes
  Eigen::Vector3d w_W_B_B = Eigen::Vector3d::Zero();  ///< angular rate [rad/s], body axes

  /// The output of an ideal accelerometer: +9.81 upwards at rest [m/s^2], body axes.
  [[nodiscard]] Eigen::Vector3d specific_force() const {
    return T_W_B.q.conjugate() * (a_W_B + kNominalGravityMps2 * Eigen::Vector3d::UnitZ());
  }
};

/// How the attitude follows from the motion.
enum class AttitudeRule {
  kEuler,   ///< yaw, pitch and roll as given: hand-held robots, wheels
  kThrust,  ///< z along the specific force, yaw as given: multirotors
};

/// A body's motion as a function of time.
struct Motion {
  AttitudeRule rule = AttitudeRule::kEuler;
  Wave x, y, z;           ///< origin of the body in the world [m]
  Wave yaw, pitch, roll;  ///< Z-Y-X Euler angles [rad]; kThrust uses yaw only

  [[nodiscard]] BodyState at(double t_s) const { return at(t_s, {}); }
  /// Of a robot that is steered away from this motion.
  [[nodiscard]] BodyState at(double t_s, const SteeredState& steered) const;
};

}  // namespace crepes
