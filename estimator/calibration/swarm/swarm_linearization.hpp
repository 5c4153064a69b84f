/// The normal equations of a swarm's batch problem.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <utility>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/batch/jet.hpp"
#include "estimator/calibration/swarm/body_interval.hpp"
#include "estimator/calibration/swarm/swarm_reading.hpp"
#include "estimator/calibration/swarm/swarm_rows.hpp"
#include "estimator/calibration/swarm/swarm_state.hpp"

namespace crepes {

/// With derivatives by the parameters of an interval, and by the time within a step.
using IntervalJet = ceres::Jet<double, interval_columns::kSize + 1>;

/// Builds  J^T J x = -J^T r  of all residuals r that `SwarmProblem` shows it, in sigmas. Units and
/// arguments are those of `SwarmCost`.
class SwarmLinearization {
 public:
  /// Adds to `system`. Both outlive it.
  SwarmLinearization(const SwarmState& state, TeamArrowSystem& system)
      : state_(state), system_(system) {}

  /// Whether it is to be shown a reading of this weight.
  [[nodiscard]] static bool wants(double weight) { return weight > 0.0; }
  /// The interval of a robot that begins at `knot`.
  void imu(std::size_t robot, std::size_t knot, const BodyInterval<IntervalJet>& interval,
           const ArrowSystem::StateMatrix& L);
  /// Rows of readings are collected, and added when those of another interval follow.
  void sighting(const SwarmReading& reading, const BodyPlace<IntervalJet>& from,
                const BodyPlace<IntervalJet>& to, const Eigen::Vector2d& uv, double sigma,
                double weight);
  /// Like a sighting.
  void range(const SwarmReading& reading, const BodyPlace<IntervalJet>& from,
             const BodyPlace<IntervalJet>& to, double range_m, double sigma, double weight);
  /// Of a pair, from a knot to the next.
  void drift(std::size_t knot, std::size_t pair, double decay, double sigma);
  /// Priors: a residual `r` and its derivative. Of a pair's drift at the first knot.
  void prior_of_drift(std::size_t pair, double r, double slope);
  /// Of a constant.
  void prior_of_constant(int index, double r, double slope);
  /// Of three states of the first knot, from `where` on.
  void prior_of_first(int where, const Eigen::RowVector3d& row, double r);
  /// Adds the rows of readings that are still collected.
  void finish();

 private:
  using Buffers = std::map<std::pair<std::size_t, std::size_t>, RowBuffer>;
  RowBuffer& buffer(Buffers& buffers, const SwarmReading& reading, int columns);

  const SwarmState& state_;
  TeamArrowSystem& system_;
  Buffers sightings_;  ///< by observer and other
  Buffers ranges_;     ///< by observer and other
};

}  // namespace crepes
