/// Smooth motions with exact derivatives.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/core/pose.hpp"

namespace crepes {

inline constexpr double kGravityMps2 = 9.81;

/// One coordinate over time: a line plus sines.
struct Wave {
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

/// What a body does at one instant.
struct BodyState {
  Pose T_W_B;
  Eigen::Vector3d v_W_B = Eigen::Vector3d::Zero();    ///< velocity [m/s], world axes
  Eigen::Vector3d a_W_B = Eigen::Vector3d::Zero();    ///< acceleration [m/s^2], world axes
  Eigen::Vector3d w_W_B_B = Eigen::Vector3d::Zero();  ///< angular rate [rad/s], body axes

  /// What an ideal accelerometer feels: +9.81 up at rest [m/s^2], body axes.
  [[nodiscard]] Eigen::Vector3d specific_force() const {
    return T_W_B.q.conjugate() * (a_W_B + kGravityMps2 * Eigen::Vector3d::UnitZ());
  }
};

enum class AttitudeRule {
  kEuler,   ///< yaw, pitch and roll as given: hands, wheels
  kThrust,  ///< the body's z follows the specific force, yaw as given: multirotors
};

/// A body's motion as a function of time.
struct Motion {
  AttitudeRule rule = AttitudeRule::kEuler;
  Wave x, y, z;           ///< origin of the body in the world [m]
  Wave yaw, pitch, roll;  ///< Z-Y-X Euler angles [rad]; kThrust uses yaw only

  [[nodiscard]] BodyState at(double t_s) const;
};

}  // namespace crepes
