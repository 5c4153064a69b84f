/// How a robot follows a velocity command.
#pragma once

namespace crepes {

/// One coordinate of a robot with a commanded velocity: three equal first-order lags, in closed
/// form from the moment of the command on. Position, velocity, acceleration and jerk are continuous
/// where one command follows another.
struct VelocityLag {
  static constexpr double kRate = 6.0;  ///< of each of the lags [rad/s]: half a second in all

  double begin_s = 0.0;                                                   ///< of the command
  double position = 0.0, velocity = 0.0, acceleration = 0.0, jerk = 0.0;  ///< at `begin_s`
  double command = 0.0;                                                   ///< a velocity

  /// The derivative of the position of this order, 0 to 3, at `t_s`, not before `begin_s`.
  [[nodiscard]] double derivative(double t_s, int order) const;
  /// The continuation after another command at `t_s`.
  [[nodiscard]] VelocityLag after(double t_s, double next_command) const;

  [[nodiscard]] bool operator==(const VelocityLag&) const = default;
};

/// The lags of a robot that is steered: its displacement from the motion that it has by itself.
struct SteeredState {
  VelocityLag x, y, z, yaw;  ///< world axes [m], [rad]

  [[nodiscard]] bool operator==(const SteeredState&) const = default;
};

}  // namespace crepes
