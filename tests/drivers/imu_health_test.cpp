#include "drivers/imu/imu_health.hpp"

#include <gtest/gtest.h>

namespace crepes::imu_health_test {
namespace {

using namespace std::chrono_literals;

/// Sample k of a sensor whose last bit always changes.
ImuSample sample_at(Timestamp stamp, int k) {
  return {.stamp = stamp, .gyro_radps = {1e-3 * k, 0, 0}, .accel_mps2 = {0, 0, 9.81}};
}

/// Samples at `spacing` from `start` on, all of which must be accepted; the time after the last.
Timestamp accept_steady(ImuHealth& health, Timestamp start, Duration spacing, int count) {
  for (int k = 0; k < count; ++k) {
    EXPECT_TRUE(health.accept(sample_at(start, k)));
    start += spacing;
  }
  return start;
}

TEST(ImuHealth, HasNothingToSayOfASteadySensor) {
  ImuHealth health(10ms);

  accept_steady(health, Timestamp{1s}, 10ms, 1000);

  EXPECT_EQ(health.diagnosis(), std::nullopt);
  EXPECT_EQ(health.counts().dropped, 0U);
  EXPECT_EQ(health.counts().stuck, 0U);
}

TEST(ImuHealth, CountsSamplesThatAreMissing) {
  ImuHealth health(10ms);

  const Timestamp gap = accept_steady(health, Timestamp{1s}, 10ms, 300);
  accept_steady(health, gap + 30ms, 10ms, 300);

  EXPECT_EQ(health.counts().dropped, 3U);
  EXPECT_EQ(health.diagnosis(), std::nullopt);
}

TEST(ImuHealth, TakesLateArrivalForNoLoss) {
  ImuHealth health(10ms);

  const Timestamp late = accept_steady(health, Timestamp{1s}, 10ms, 10) + 4ms;
  accept_steady(health, late, 6ms, 2);

  EXPECT_EQ(health.counts().dropped, 0U);
}

TEST(ImuHealth, RefusesWhatRepeatsForHalfASecondUntilItChanges) {
  ImuHealth health(10ms);
  int refused = 0;
  for (int k = 0; k <= 100; ++k)
    refused += health.accept(sample_at(Timestamp{1s} + k * 10ms, 7)) ? 0 : 1;

  EXPECT_EQ(refused, 51);  // from 0.5 s to 1 s
  EXPECT_EQ(health.counts().stuck, 51U);
  ASSERT_TRUE(health.diagnosis());
  EXPECT_NE(health.diagnosis()->find("repeats"), std::string::npos);

  EXPECT_TRUE(health.accept(sample_at(Timestamp{2010ms}, 8)));
  EXPECT_EQ(health.diagnosis(), std::nullopt);
}

TEST(ImuHealth, ReportsARateOtherThanTheConfigured) {
  ImuHealth slow(10ms);
  accept_steady(slow, Timestamp{1s}, 20ms, 400);
  ImuHealth fast(10ms);
  accept_steady(fast, Timestamp{1s}, 5ms, 400);

  EXPECT_NE(slow.diagnosis().value_or("").find("fewer"), std::string::npos);
  EXPECT_NE(fast.diagnosis().value_or("").find("more"), std::string::npos);
}

}  // namespace
}  // namespace crepes::imu_health_test
