/// What a swarm's state costs, and the residuals of its readings.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/swarm/body_interval.hpp"
#include "estimator/calibration/swarm/swarm_problem.hpp"
#include "estimator/calibration/swarm/swarm_reading.hpp"
#include "estimator/calibration/swarm/swarm_state.hpp"

namespace crepes {

/// Sums half the squares of all residuals that `SwarmProblem` shows it, in sigmas. Keeps those of
/// the readings if there is a place for them.
class SwarmCost {
 public:
  /// `state` outlives it, and so do `residuals`, which have a place for each reading; null: none.
  SwarmCost(const SwarmState& state, SwarmResiduals* residuals)
      : state_(state), residuals_(residuals) {}

  /// Whether it is to be shown a reading of this weight. Residuals are those of all readings.
  [[nodiscard]] bool wants(double weight) const { return weight > 0.0 || residuals_ != nullptr; }
  /// The interval of a robot that begins at `knot`. `L` whitens its end [theta, v, p, biases].
  void imu(std::size_t robot, std::size_t knot, const BodyInterval<double>& interval,
           const ArrowSystem::StateMatrix& L);
  /// `uv` and `sigma` in pixels. `from` is where the observer was, `to` where the other was.
  void sighting(const SwarmReading& reading, const BodyPlace<double>& from,
                const BodyPlace<double>& to, const Eigen::Vector2d& uv, double sigma,
                double weight);
  /// `range_m` is measured. `sigma` in metres.
  void range(const SwarmReading& reading, const BodyPlace<double>& from,
             const BodyPlace<double>& to, double range_m, double sigma, double weight);
  /// From a knot to the next, a pair's drift is `decay` times as large, and `sigma` [m] is added.
  void drift(std::size_t knot, std::size_t pair, double decay, double sigma);
  /// Priors: a residual `r` and its derivative. Of a pair's drift at the first knot.
  void prior_of_drift(std::size_t /*pair*/, double r, double /*slope*/) { sum_ += 0.5 * r * r; }
  /// Of a constant.
  void prior_of_constant(int /*index*/, double r, double /*slope*/) { sum_ += 0.5 * r * r; }
  /// Of three states of the first knot, from `where` on.
  void prior_of_first(int /*where*/, const Eigen::RowVector3d& /*row*/, double r) {
    sum_ += 0.5 * r * r;
  }

  [[nodiscard]] double sum() const { return sum_; }

 private:
  const SwarmState& state_;
  SwarmResiduals* residuals_;
  double sum_ = 0.0;
};

}  // namespace crepes
