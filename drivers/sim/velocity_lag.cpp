#include "drivers/sim/velocity_lag.hpp"

#include <cmath>

namespace crepes {

// The velocity's error e = v - command decays as  e(t) = P(t) exp(-w t),  P(t) = c0 + c1 t + c2
// t^2/2.
double VelocityLag::derivative(double t_s, int order) const {
  const double w = kRate;
  const double t = t_s - begin_s;
  const double c0 = velocity - command;
  const double c1 = acceleration + w * c0;
  const double c2 = jerk + 2.0 * w * acceleration + w * w * c0;
  const double decay = std::exp(-w * t);
  const double P = c0 + c1 * t + c2 * t * t / 2.0;
  const double P_dot = c1 + c2 * t;
  switch (order) {
    case 0: {
      const double whole = c0 / w + c1 / (w * w) + c2 / (w * w * w);
      const double left = P / w + P_dot / (w * w) + c2 / (w * w * w);
      return position + command * t + whole - left * decay;
    }
    case 1:
      return command + P * decay;
    case 2:
      return (P_dot - w * P) * decay;
    default:
      return (c2 - 2.0 * w * P_dot + w * w * P) * decay;
  }
}

VelocityLag VelocityLag::after(double t_s, double next_command) const {
  return {
      t_s,         derivative(t_s, 0), derivative(t_s, 1), derivative(t_s, 2), derivative(t_s, 3),
      next_command};
}

}  // namespace crepes
