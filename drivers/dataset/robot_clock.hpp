/// How a robot's clock relates to true time. Only recordings and simulations know it.
#pragma once

#include <cmath>

#include "estimator/core/time.hpp"

namespace crepes {

/// local = true (1 + skew) + offset.
struct RobotClock {
  double offset_s = 0.0;
  double skew_ppm = 0.0;

  [[nodiscard]] Timestamp local(double true_s) const {
    const double local_s = true_s * (1.0 + skew_ppm * 1e-6) + offset_s;
    return Timestamp{Duration{std::llround(local_s * 1e9)}};
  }

  [[nodiscard]] double true_s(Timestamp local) const {
    return (to_seconds(local.time_since_epoch()) - offset_s) / (1.0 + skew_ppm * 1e-6);
  }
};

}  // namespace crepes
