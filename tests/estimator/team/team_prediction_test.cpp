#include "estimator/team/team_prediction.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"

namespace crepes::team_prediction_test {
namespace {

using namespace std::chrono_literals;
using Errors = Eigen::Matrix<double, TeamPose::kMotion + TeamPose::kBiases, 1>;

constexpr Timestamp kBegin{1s};

ImuHistory steady(const Eigen::Vector3d& gyro_radps, const Eigen::Vector3d& accel_mps2) {
  ImuHistory imu;
  for (Timestamp t = kBegin - 100ms; t <= kBegin + 600ms; t += 10ms)
    imu.push({.stamp = t, .gyro_radps = gyro_radps, .accel_mps2 = accel_mps2});
  return imu;
}

/// Its errors [p, v, theta] from another one.
Eigen::Matrix<double, 9, 1> difference(const TeamPose& from, const TeamPose& to) {
  const Vector6d of_pose = pose_difference(from.T_B_N, to.T_B_N);
  Eigen::Matrix<double, 9, 1> all;
  all << of_pose.head<3>(), to.v_B_N - from.v_B_N, of_pose.tail<3>();
  return all;
}

class TeamPrediction : public testing::Test {
 protected:
  [[nodiscard]] TeamPose predict(const TeamPose& pose, const ImuBiasEstimate& bias_B,
                                 const ImuBiasEstimate& bias_N) const {
    return predicted(pose, {imu_B_, imu_N_, bias_B, bias_N}, kBegin, kBegin + 300ms, {});
  }
  /// What the prediction is if the errors of the estimate are these.
  [[nodiscard]] TeamPose truth(const TeamPose& pose, const Errors& errors) const {
    TeamPose true_pose = pose;
    Vector6d of_pose;
    of_pose << errors.head<3>(), errors.segment<3>(6);
    true_pose.T_B_N = perturbed(pose.T_B_N, of_pose);
    true_pose.v_B_N += errors.segment<3>(3);
    return predict(true_pose,
                   {.gyro_radps = errors.segment<3>(9), .accel_mps2 = errors.segment<3>(12)},
                   {.gyro_radps = errors.segment<3>(15), .accel_mps2 = errors.segment<3>(18)});
  }

  ImuHistory imu_B_ = steady({0.3, -0.2, 0.5}, {0.5, 0.2, 9.8});
  ImuHistory imu_N_ = steady({-0.4, 0.1, 0.2}, {-0.3, 0.6, 9.7});
};

// A bias error has moved the pose already, and goes on in the same direction.
TEST_F(TeamPrediction, CountsWhatThePoseShareWithTheBiases) {
  test::RandomGeometry random(1);
  constexpr int kDraws = 400;
  double nees = 0.0;
  double without_correlation = 0.0;
  TeamPose pose{.T_B_N = random.pose(), .v_B_N = {0.2, -0.5, 0.1}};
  // Sigmas of a settled filter.
  Errors sigma;
  sigma << Eigen::Vector3d::Constant(0.02), Eigen::Vector3d::Constant(0.01),
      Eigen::Vector3d::Constant(0.002), Eigen::Vector3d::Constant(0.004),
      Eigen::Vector3d::Constant(0.05), Eigen::Vector3d::Constant(0.004),
      Eigen::Vector3d::Constant(0.05);
  pose.covariance = sigma.asDiagonal();
  pose.covariance = pose.covariance * pose.covariance.transpose();
  // The velocity has followed the accelerometers' biases for a fifth of a second.
  TeamPose::Covariance grown = TeamPose::Covariance::Identity();
  grown.block<3, 3>(3, 12) = 0.2 * Eigen::Matrix3d::Identity();
  grown.block<3, 3>(3, 18) = -0.2 * pose.T_B_N.R();
  pose.covariance = grown * pose.covariance * grown.transpose();
  TeamPose independent = pose;
  independent.covariance.topRightCorner<9, 12>().setZero();
  independent.covariance.bottomLeftCorner<12, 9>().setZero();

  const auto P = predict(pose, {}, {}).covariance.topLeftCorner<9, 9>().eval();
  const auto Q = predict(independent, {}, {}).covariance.topLeftCorner<9, 9>().eval();
  for (int i = 0; i < kDraws; ++i) {
    const Errors errors = random.draw<21>(pose.covariance);
    const auto e = difference(predict(pose, {}, {}), truth(pose, errors));
    nees += e.dot(P.llt().solve(e)) / kDraws;
    without_correlation += e.dot(Q.llt().solve(e)) / kDraws;
  }
  EXPECT_NEAR(nees, 9.0, 0.9);  // four sigmas of the mean
  EXPECT_GT(without_correlation, 10.5);
}

TEST_F(TeamPrediction, TakesTheNeighborAtItsOwnClock) {
  ImuHistory changing;
  for (Timestamp t = kBegin - 100ms; t <= kBegin + 600ms; t += 10ms)
    changing.push({.stamp = t,
                   .gyro_radps = {0.0, 0.0, t > kBegin + 200ms ? 1.0 : 0.0},
                   .accel_mps2 = {0.0, 0.0, 9.8}});
  const ImuHistory rest = steady(Eigen::Vector3d::Zero(), {0.0, 0.0, 9.8});
  TeamPose pose;
  const auto turned_rad = [&](Duration ahead) {
    pose.clock_ahead = ahead;
    const TeamPose after =
        predicted(pose, {rest, changing, {}, {}}, kBegin, kBegin + 300ms, ProcessNoise{});
    return so3_log(after.T_B_N.q).z();
  };
  EXPECT_NEAR(turned_rad(0ms), 0.1, 1e-6);
  EXPECT_NEAR(turned_rad(100ms), 0.2, 1e-6);
}

}  // namespace
}  // namespace crepes::team_prediction_test
