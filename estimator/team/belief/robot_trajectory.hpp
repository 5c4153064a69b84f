/// One robot's motion over an interval in a free-falling frame, by its IMU.
#pragma once

#include <vector>

#include "estimator/core/imu_history.hpp"
#include "estimator/relative/error_state.hpp"
#include "estimator/relative/propagation.hpp"
#include "estimator/team/belief/free_motion.hpp"

namespace crepes {

/// A motion with its derivative by the errors of the IMU that brought the body there. How it
/// depends on where the body began, `by_earlier` says.
struct FreeMotionAt {
  static constexpr int kMotion = FreeMotion::kErrors;
  /// Gyro bias, accel bias, and by columns the gyroscope's scale and axis errors.
  static constexpr int kBias = 15;

  double t_s = 0.0;  ///< after the beginning
  FreeMotion motion;
  Eigen::Matrix<double, kMotion, kBias> by_bias;
  MotionMatrix noise;  ///< covariance that the IMU's noise has added
};

/// Steps of `TeamInterval::kStep`, the last one shorter.
class RobotTrajectory {
 public:
  RobotTrajectory(const FreeMotion& start, ImuBias bias, const std::vector<ImuMean>& imu,
                  double duration_s, const ProcessNoise& noise);

  /// At `t_s` after the beginning, within the interval.
  [[nodiscard]] FreeMotionAt at(double t_s) const;
  /// The motion alone, which costs a tenth.
  [[nodiscard]] FreeMotion motion_at(double t_s) const;
  /// Of a point of the body [m/s].
  [[nodiscard]] Eigen::Vector3d velocity_F(double t_s, const Eigen::Vector3d& p_B) const;
  /// At the step nearest to `t_s`.
  [[nodiscard]] const FreeMotionAt& nearest(double t_s) const;
  [[nodiscard]] const FreeMotionAt& end() const { return grid_.back(); }

 private:
  struct Step;
  [[nodiscard]] Step step_at(double t_s) const;
  [[nodiscard]] Step rates(std::size_t index, double dt) const;
  [[nodiscard]] FreeMotionAt advanced(const FreeMotionAt& from, const Step& step) const;

  const std::vector<ImuMean>* imu_;
  ImuBias bias_;
  ProcessNoise noise_;
  std::vector<FreeMotionAt> grid_;
};

}  // namespace crepes
