#include "drivers/sim/motion.hpp"

#include <cmath>
#include <numbers>

namespace crepes {
namespace {

struct Attitude {
  Eigen::Quaterniond q_W_B;
  Eigen::Vector3d w_W_B_B;
};

/// Derivative of u/|u|.
Eigen::Vector3d unit_rate(const Eigen::Vector3d& u, const Eigen::Vector3d& u_dot) {
  const Eigen::Vector3d unit = u.normalized();
  return (u_dot - unit * unit.dot(u_dot)) / u.norm();
}

/// An angle and its rate.
struct Heading {
  double yaw;
  double yaw_dot;
};

/// R = Rz(yaw) Ry(pitch) Rx(roll), and its body rates.
Attitude euler_attitude(const Motion& m, double t, const Heading& h) {
  const double pitch = m.pitch.derivative(t, 0);
  const double roll = m.roll.derivative(t, 0);
  const double pitch_dot = m.pitch.derivative(t, 1);
  const double roll_dot = m.roll.derivative(t, 1);
  const double s = std::sin(roll);
  const double c = std::cos(roll);
  return {Eigen::AngleAxisd(h.yaw, Eigen::Vector3d::UnitZ()) *
              Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
              Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()),
          {roll_dot - h.yaw_dot * std::sin(pitch), pitch_dot * c + h.yaw_dot * s * std::cos(pitch),
           -pitch_dot * s + h.yaw_dot * c * std::cos(pitch)}};
}

/// Axes  z = f/|f|,  y = (z x h)/|z x h|,  x = y x z  with specific force f and heading h; the
/// rates are  w = (-y.z', x.z', -x.y').
Attitude thrust_attitude(const Heading& h, const Eigen::Vector3d& force,
                         const Eigen::Vector3d& jerk) {
  const Eigen::Vector3d heading(std::cos(h.yaw), std::sin(h.yaw), 0.0);
  const Eigen::Vector3d heading_dot(-h.yaw_dot * heading.y(), h.yaw_dot * heading.x(), 0.0);

  const Eigen::Vector3d z = force.normalized();
  const Eigen::Vector3d z_dot = unit_rate(force, jerk);
  const Eigen::Vector3d side = z.cross(heading);
  const Eigen::Vector3d y = side.normalized();
  const Eigen::Vector3d y_dot = unit_rate(side, z_dot.cross(heading) + z.cross(heading_dot));
  const Eigen::Vector3d x = y.cross(z);

  Eigen::Matrix3d R_W_B;
  R_W_B << x, y, z;
  return {Eigen::Quaterniond(R_W_B), {-y.dot(z_dot), x.dot(z_dot), -x.dot(y_dot)}};
}

}  // namespace

double Wave::derivative(double t_s, int order) const {
  double value = 0.0;
  if (order == 0) value = offset + slope_ps * t_s;
  if (order == 1) value = slope_ps;
  for (const Sine& sine : sines) {
    value += sine.amplitude * std::pow(sine.omega_radps, order) *
             std::sin(sine.omega_radps * t_s + sine.phase_rad + order * std::numbers::pi / 2.0);
  }
  return value;
}

BodyState Motion::at(double t_s, const SteeredState& steered) const {
  const auto position_derivative = [&](int order) {
    return Eigen::Vector3d(x.derivative(t_s, order) + steered.x.derivative(t_s, order),
                           y.derivative(t_s, order) + steered.y.derivative(t_s, order),
                           z.derivative(t_s, order) + steered.z.derivative(t_s, order));
  };
  const Heading heading{yaw.derivative(t_s, 0) + steered.yaw.derivative(t_s, 0),
                        yaw.derivative(t_s, 1) + steered.yaw.derivative(t_s, 1)};
  const Eigen::Vector3d a_W_B = position_derivative(2);
  const Attitude attitude =
      rule == AttitudeRule::kEuler
          ? euler_attitude(*this, t_s, heading)
          : thrust_attitude(heading, a_W_B + kNominalGravityMps2 * Eigen::Vector3d::UnitZ(),
                            position_derivative(3));
  return {.T_W_B = {position_derivative(0), attitude.q_W_B.normalized()},
          .v_W_B = position_derivative(1),
          .a_W_B = a_W_B,
          .w_W_B_B = attitude.w_W_B_B};
}

}  // namespace crepes
