/// The batch problem of a swarm's calibration: robots that see and range one another, each carried
/// along by its IMU.
#pragma once

#include <optional>
#include <vector>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/camera/camera_problem.hpp"
#include "estimator/calibration/swarm/swarm_state.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {

/// A range to another robot.
struct RobotRange {
  Timestamp stamp{};
  std::size_t other = 0;  ///< index of the robot
  double range_m = 0.0;
};

/// What one robot recorded, all stamps brought to one clock as well as it is known.
struct RobotRecord {
  std::vector<ImuSample> imu;            ///< by stamp
  std::vector<BoardSighting> sightings;  ///< by stamp; `board` is the index of a robot
  std::vector<RobotRange> ranges;        ///< by stamp
  ImuNoise noise;                        ///< with vibration
  RangeNoise range_noise;                ///< of biases; the scatter is taken from the residuals
};

/// What readings weigh: one each, or less for outliers; 0 leaves one out. By robot and reading.
struct SwarmWeights {
  std::vector<std::vector<double>> sightings;
  std::vector<std::vector<double>> ranges;
};

/// The residuals of all sightings and ranges, by robot.
struct SwarmResiduals {
  std::vector<std::vector<SightingResidual>> sightings;
  std::vector<std::vector<double>> ranges;  ///< [m], measured minus predicted; NaN: none
};

/// Knots of all robots every 0.02 s, farther apart for more than four robots. A reading between two
/// knots sees each robot where its IMU carried it since the earlier one. The bias of a pair's
/// ranges is that of both modules, a constant of its own, and a drift: a first-order Gauss-Markov
/// process from knot to knot.
class SwarmProblem {
 public:
  /// Readings outside [from, to] are left out.
  SwarmProblem(std::vector<RobotRecord> records, Timestamp from, Timestamp to);

  [[nodiscard]] std::size_t robots() const { return records_.size(); }
  [[nodiscard]] std::size_t knots() const { return first_sample_.front().size(); }
  [[nodiscard]] const std::vector<RobotRecord>& records() const { return records_; }
  [[nodiscard]] Timestamp time_of(std::size_t robot, std::size_t knot) const {
    return records_[robot].imu[first_sample_[robot][knot]].stamp;
  }

  void set_priors(std::vector<RobotPriors> priors) { priors_ = std::move(priors); }
  void set_weights(SwarmWeights weights) { weights_ = std::move(weights); }
  /// One sigma of a spot's coordinate, by observer, and of a range.
  void set_sigmas(std::vector<double> sigma_px, double sigma_m) {
    sigma_px_ = std::move(sigma_px);
    sigma_m_ = sigma_m;
  }
  [[nodiscard]] const std::vector<double>& sigma_px() const { return sigma_px_; }
  [[nodiscard]] double sigma_m() const { return sigma_m_; }
  [[nodiscard]] const std::vector<RobotPriors>& priors() const { return priors_; }

  [[nodiscard]] double cost(const SwarmState& state, const SwarmState& prior) const;
  [[nodiscard]] TeamArrowSystem linearize(const SwarmState& state, const SwarmState& prior) const;
  [[nodiscard]] SwarmResiduals residuals(const SwarmState& state) const;

 private:
  template <class T>
  friend class SwarmWalk;

  /// Where an instant lies: the interval, the step within it, and the time within that.
  struct Place {
    std::size_t knot = 0;
    std::size_t step = 0;
    double tau = 0.0;
  };
  [[nodiscard]] std::optional<Place> place_of(std::size_t robot, double time_s) const;
  [[nodiscard]] double seconds(Timestamp t) const { return to_seconds(t - from_); }
  void set_pair_noise();
  template <class Visitor>
  void visit_priors(const SwarmState& state, const SwarmState& prior, Visitor& visitor) const;
  template <class T, class Visitor>
  void visit(const SwarmState& state, Visitor& visitor) const;

  std::vector<RobotRecord> records_;
  Timestamp from_;
  std::vector<std::vector<double>> imu_s_;
  std::vector<std::vector<std::size_t>> first_sample_;
  SwarmWeights weights_;
  std::vector<RobotPriors> priors_;
  std::vector<double> sigma_px_;
  double sigma_m_ = 1.0;
  std::vector<RangeNoise> pair_noise_;  ///< by `pair_index`
};

}  // namespace crepes
