#include "drivers/sim/velocity_lag.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace crepes::velocity_lag_test {
namespace {

constexpr VelocityLag kSome{.begin_s = 3.0,
                            .position = 1.0,
                            .velocity = 0.4,
                            .acceleration = -0.3,
                            .jerk = 2.0,
                            .command = -0.7};

TEST(VelocityLag, BeginsWhereItIsCommandedTo) {
  EXPECT_NEAR(kSome.derivative(3.0, 0), 1.0, 1e-12);
  EXPECT_NEAR(kSome.derivative(3.0, 1), 0.4, 1e-12);
  EXPECT_NEAR(kSome.derivative(3.0, 2), -0.3, 1e-12);
  EXPECT_NEAR(kSome.derivative(3.0, 3), 2.0, 1e-12);
}

TEST(VelocityLag, IsTheIntegralOfItsDerivatives) {
  constexpr double kStep = 1e-4;  // central differences: error about 1e-8 * third derivative
  for (double t = 3.1; t < 8.0; t += 0.37) {
    for (int order = 0; order < 3; ++order) {
      const double slope =
          (kSome.derivative(t + kStep, order) - kSome.derivative(t - kStep, order)) / (2 * kStep);
      EXPECT_NEAR(slope, kSome.derivative(t, order + 1), 1e-5) << order << " at " << t;
    }
  }
}

TEST(VelocityLag, ReachesTheCommand) {
  EXPECT_NEAR(kSome.derivative(8.0, 1), -0.7, 1e-6);
  EXPECT_NEAR(kSome.derivative(8.0, 2), 0.0, 1e-6);
}

TEST(VelocityLag, ContinuesSmoothlyWithTheNextCommand) {
  const VelocityLag next = kSome.after(3.2, 0.9);

  for (int order = 0; order < 4; ++order)
    EXPECT_NEAR(next.derivative(3.2, order), kSome.derivative(3.2, order), 1e-12);
  EXPECT_NEAR(next.derivative(9.0, 1), 0.9, 1e-6);
}

TEST(VelocityLag, IsTheSameWhenTheSameCommandIsRepeated) {
  const VelocityLag same = kSome.after(3.2, kSome.command);

  EXPECT_NEAR(same.derivative(4.0, 0), kSome.derivative(4.0, 0), 1e-12);
  EXPECT_NEAR(same.derivative(4.0, 3), kSome.derivative(4.0, 3), 1e-9);
}

}  // namespace
}  // namespace crepes::velocity_lag_test
