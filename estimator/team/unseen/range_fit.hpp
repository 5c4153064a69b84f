/// The motion of a robot that nobody saw, by least squares over its ranges.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <limits>
#include <optional>

#include "estimator/team/belief/team_place.hpp"
#include "estimator/team/unseen/range_problem.hpp"

namespace crepes {

/// Least squares over all ranges from one start on.
class RangeFit {
 public:
  /// From the attitude in which the IMU's path bends like the track, or a given one.
  RangeFit(const RangeProblem& problem, const RangeTrack& track,
           const std::optional<Eigen::Quaterniond>& attitude);

  /// What was found, but for the IMU's errors.
  [[nodiscard]] RangeTrack track() const;
  /// The attitude at the first beginning, turned about what is up.
  [[nodiscard]] Eigen::Quaterniond turned(double angle) const;
  /// Infinite if there is no solution, or if the robot flies upside down: what is up for self is so
  /// for the robot.
  [[nodiscard]] double cost() const;
  /// Whether it converged, on likely errors that explain the ranges.
  [[nodiscard]] bool is_consistent() const;
  /// At the end, in the frame that then falls freely with self, with the noise of both IMUs.
  [[nodiscard]] TeamPlace place() const;

 private:
  [[nodiscard]] ImuErrors imu_errors() const;
  /// False if there is no solution.
  [[nodiscard]] bool linearize();
  void add(const FittedRange& z);
  void apply(const Eigen::VectorXd& step);

  const RangeProblem* problem_;
  FreeMotion start_;
  Eigen::VectorXd errors_;  ///< of IMU and beacons; zero for the motion
  Eigen::MatrixXd information_;
  Eigen::LDLT<Eigen::MatrixXd> factors_;
  Eigen::VectorXd gradient_;
  double cost_ = std::numeric_limits<double>::infinity();
  std::size_t outliers_ = 0;
  bool is_converged_ = false;
  CarriedMotion end_;
};

}  // namespace crepes
