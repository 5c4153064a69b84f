#include "estimator/calibration/swarm/swarm_factors.hpp"

#include <gtest/gtest.h>

#include "estimator/core/so3.hpp"
#include "tests/support/calibration_swarm.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace crepes::swarm_factors_test {
namespace {

struct TwoRobots {
  RobotConstants observer;
  RobotConstants other;
  BodyAt observer_at{so3_exp({0.2, -0.3, 0.4}), {0.3, -0.2, 1.1}};
  BodyAt other_at{so3_exp({-0.4, 0.1, 2.0}), {3.1, 0.9, 1.7}};

  TwoRobots() {
    simulated::Dice dice(5);
    observer = simulated::built_robot(dice);
    other = simulated::built_robot(dice);
  }
};

BodyAt moved_body(const BodyAt& body, const Eigen::Matrix<double, 6, 1>& d) {
  return {body.q_W_B * so3_exp(d.head<3>()), body.p_W + d.tail<3>()};
}

TEST(SwarmFactors, ASightingHasTheDerivativesOfItsPrediction) {
  namespace at = sighting_columns;
  const TwoRobots two;
  const auto factor = linearize_sighting(two.observer, two.observer_at, two.other, two.other_at);
  ASSERT_TRUE(factor);

  const auto numeric = test::numeric_jacobian<2, at::kSize>(
      [&](const Eigen::Matrix<double, at::kSize, 1>& d) -> Eigen::Vector2d {
        RobotConstants observer = two.observer;
        RobotConstants other = two.other;
        observer.camera.lens += d.segment<6>(at::kCamera);
        observer.camera.q_C_B = observer.camera.q_C_B * so3_exp(d.segment<3>(at::kCamera + 6));
        observer.camera.p_B_C += d.segment<3>(at::kCamera + 9);
        other.p_B_M += d.segment<3>(at::kRing);
        return *predicted_spot(observer, moved_body(two.observer_at, d.head<6>()), other,
                               moved_body(two.other_at, d.segment<6>(at::kOther)));
      });

  EXPECT_LT(test::largest_difference(factor->J, numeric), 1e-5);  // of pixels: entries of 300
  const auto uv = predicted_spot(two.observer, two.observer_at, two.other, two.other_at);
  EXPECT_LT((factor->uv - *uv).norm(), 1e-9);
}

TEST(SwarmFactors, ARangeHasTheDerivativesOfItsPrediction) {
  namespace at = range_columns;
  const TwoRobots two;
  const auto factor =
      linearize_antenna_range(two.observer, two.observer_at, two.other, two.other_at);
  ASSERT_TRUE(factor);

  const auto numeric = test::numeric_jacobian<1, at::kSize>(
      [&](const Eigen::Matrix<double, at::kSize, 1>& d) -> Eigen::Matrix<double, 1, 1> {
        RobotConstants observer = two.observer;
        RobotConstants other = two.other;
        observer.p_B_U += d.segment<3>(at::kAntenna);
        other.p_B_U += d.segment<3>(at::kOtherAntenna);
        observer.range_delay_m += d(at::kDelay);
        other.range_delay_m += d(at::kOtherDelay);
        return Eigen::Matrix<double, 1, 1>(
            linearize_antenna_range(observer, moved_body(two.observer_at, d.head<6>()), other,
                                    moved_body(two.other_at, d.segment<6>(at::kOther)))
                ->range_m);
      });

  EXPECT_LT(test::largest_difference(factor->J, numeric), 1e-8);
}

TEST(SwarmFactors, AntennasThatCoincideHaveNoRange) {
  const TwoRobots two;

  EXPECT_FALSE(
      linearize_antenna_range(two.observer, two.observer_at, two.observer, two.observer_at));
}

TEST(SwarmFactors, ClocksTurnStampsIntoCommonTimeAndBack) {
  RobotConstants robot;
  robot.clock_s = 2e-3;
  robot.clock_skew = 2e-5;

  EXPECT_NEAR(robot.stamp_s(robot.common_s(40.0)), 40.0, 1e-7);
  EXPECT_NEAR(robot.common_s(40.0), 40.0 - 2e-3 - 8e-4, 1e-12);
}

}  // namespace
}  // namespace crepes::swarm_factors_test
