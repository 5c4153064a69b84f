#include "estimator/team/belief/robot_trajectory.hpp"

#include <gtest/gtest.h>

#include "estimator/team/belief/team_interval.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::robot_trajectory_test {
namespace {

using test::largest_difference;
using test::numeric_jacobian;
using test::RandomGeometry;

constexpr int kStart = FreeMotionAt::kMotion + FreeMotionAt::kBias;
using Start = Eigen::Matrix<double, kStart, 1>;
using Motion = Eigen::Matrix<double, FreeMotionAt::kMotion, 1>;

constexpr double kDuration = 0.095;  // s; the last step is shorter

std::vector<ImuMean> random_imu(RandomGeometry& random) {
  std::vector<ImuMean> imu(10);
  for (ImuMean& mean : imu) {
    mean.gyro_radps = random.vector(2.0);
    mean.accel_mps2 = Eigen::Vector3d(0.0, 0.0, 9.81) + random.vector(3.0);
    mean.gyro_noise_density = 1e-3;
    mean.accel_noise_density = 1e-2;
  }
  return imu;
}

FreeMotion random_motion(RandomGeometry& random) {
  return {random.vector(3.0), random.vector(1.0), random.rotation()};
}

FreeMotion perturbed(const FreeMotion& motion, const Start& d) {
  return {motion.p_F + d.head<3>(), motion.v_F + d.segment<3>(3),
          motion.q_F_B * so3_exp(d.segment<3>(6))};
}

Motion difference(const FreeMotion& from, const FreeMotion& to) {
  Motion d;
  d << to.p_F - from.p_F, to.v_F - from.v_F, so3_log(from.q_F_B.conjugate() * to.q_F_B);
  return d;
}

TEST(RobotTrajectory, DerivativesByTheStartAreThoseOfTheTrajectory) {
  RandomGeometry random(1);
  for (int i = 0; i < 20; ++i) {
    const std::vector<ImuMean> imu = random_imu(random);
    const FreeMotion start = random_motion(random);
    const double t_s = i == 0 ? kDuration : random.uniform(0.0, kDuration);
    const auto motion_at = [&](const Start& d) {
      ImuBias bias{.gyro_radps = d.segment<3>(9), .accel_mps2 = d.segment<3>(12)};
      bias.gyro_scale = d.tail<9>().reshaped<Eigen::ColMajor>(3, 3);
      return RobotTrajectory(perturbed(start, d), bias, imu, kDuration, {}).at(t_s);
    };
    const FreeMotionAt at = motion_at(Start::Zero());
    const auto numeric = numeric_jacobian<FreeMotionAt::kMotion, kStart>(
        [&](const Start& d) { return difference(at.motion, motion_at(d).motion); });
    Eigen::Matrix<double, FreeMotionAt::kMotion, kStart> exact;
    exact << by_earlier(start, at.motion, t_s), at.by_bias;
    EXPECT_LT(largest_difference(exact, numeric), 1e-7) << "at " << t_s;
  }
}

TEST(RobotTrajectory, IsContinuousAndEndsWithItsLastStep) {
  RandomGeometry random(2);
  const std::vector<ImuMean> imu = random_imu(random);
  const RobotTrajectory path(random_motion(random), {}, imu, kDuration, {});
  EXPECT_LT(difference(path.at(kDuration).motion, path.end().motion).norm(), 1e-12);
  for (double t_s = 0.01; t_s < kDuration; t_s += 0.01)
    EXPECT_LT(difference(path.at(t_s - 1e-9).motion, path.at(t_s + 1e-9).motion).norm(), 1e-7);
}

// Two bodies seen in the falling frame move relative to each other as the pair's filter says.
TEST(RobotTrajectory, RelativeMotionIsThatOfThePairsFilter) {
  RandomGeometry random(3);
  const std::vector<ImuMean> imu_B = random_imu(random);
  const std::vector<ImuMean> imu_N = random_imu(random);
  const FreeMotion start = random_motion(random);
  const FreeMotion B = RobotTrajectory({}, {}, imu_B, kDuration, {}).end().motion;
  const FreeMotion N = RobotTrajectory(start, {}, imu_N, kDuration, {}).end().motion;
  RelativeMotion pair{{start.p_F, start.q_F_B}, start.v_F};
  for (std::size_t i = 0; i < imu_B.size(); ++i) {
    const double dt = std::min(0.01, kDuration - 0.01 * static_cast<double>(i));
    pair = propagated(pair, {imu_B[i].gyro_radps, imu_B[i].accel_mps2},
                      {imu_N[i].gyro_radps, imu_N[i].accel_mps2}, dt);
  }
  const Eigen::Quaterniond q_B_F = B.q_F_B.conjugate();
  EXPECT_LT((q_B_F * (N.p_F - B.p_F) - pair.T_B_N.p).norm(), 1e-9);
  EXPECT_LT((q_B_F * (N.v_F - B.v_F) - pair.v_B_N).norm(), 1e-9);
  EXPECT_LT(so3_log((q_B_F * N.q_F_B).conjugate() * pair.T_B_N.q).norm(), 1e-9);
}

TEST(RobotTrajectory, NoiseIsThatOfRepeatedDraws) {
  constexpr int kDraws = 2000;
  RandomGeometry random(4);
  const std::vector<ImuMean> imu = random_imu(random);
  const FreeMotion start = random_motion(random);
  const FreeMotionAt exact = RobotTrajectory(start, {}, imu, kDuration, {}).end();
  Eigen::Matrix<double, 9, 9> sampled = Eigen::Matrix<double, 9, 9>::Zero();
  for (int i = 0; i < kDraws; ++i) {
    std::vector<ImuMean> noisy = imu;
    for (std::size_t step = 0; step < noisy.size(); ++step) {
      const double dt = std::min(0.01, kDuration - 0.01 * static_cast<double>(step));
      noisy[step].gyro_radps += random.vector(1e-3 / std::sqrt(dt));
      noisy[step].accel_mps2 += random.vector(1e-2 / std::sqrt(dt));
    }
    const Motion d =
        difference(exact.motion, RobotTrajectory(start, {}, noisy, kDuration, {}).end().motion);
    sampled += d * d.transpose() / kDraws;
  }
  const Eigen::Matrix<double, 9, 1> ratio =
      sampled.diagonal().cwiseQuotient(exact.noise.diagonal());
  EXPECT_GT(ratio.minCoeff(), 0.85) << ratio.transpose();
  EXPECT_LT(ratio.maxCoeff(), 1.15) << ratio.transpose();
}

}  // namespace
}  // namespace crepes::robot_trajectory_test
