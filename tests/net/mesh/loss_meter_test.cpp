#include "net/mesh/loss_meter.hpp"

#include <gtest/gtest.h>

namespace crepes::loss_meter_test {
namespace {

TEST(LossMeter, FollowsWhatIsMissing) {
  LossMeter meter;
  for (std::uint64_t missing = 0; missing < 200; ++missing) meter.update(missing);

  EXPECT_NEAR(meter.share(), 0.5, 0.02);
  EXPECT_EQ(meter.lost(), 199U);
}

TEST(LossMeter, ADatagramThatArrivesLateIsNotLost) {
  LossMeter meter;
  meter.update(1);
  meter.update(0);

  EXPECT_EQ(meter.lost(), 0U);
  EXPECT_NEAR(meter.share(), 0.0, 0.01);
}

TEST(LossMeter, ForgetsALongAbsenceInSeconds) {
  LossMeter meter;
  for (int i = 0; i < 100; ++i) meter.update(0);

  for (int i = 0; i < 50; ++i) meter.update(90'000);  // an hour, then two seconds

  EXPECT_LT(meter.share(), 0.3);
  EXPECT_EQ(meter.lost(), 90'000U);
}

TEST(LossMeter, WhatIsNotForwardedIsNotLost) {
  LossMeter meter;
  for (std::uint32_t n = 0; n < 100; ++n) meter.update_forwarded(std::uint64_t{5} * n, 6 * n, 6);
  EXPECT_EQ(meter.lost(), 0U);

  meter.update_forwarded(510, 6 * 102, 6);
  EXPECT_EQ(meter.lost(), 2U);
  meter.update_forwarded(509, 6 * 101, 6);
  EXPECT_EQ(meter.lost(), 1U) << "late";
  meter.update(520);
  EXPECT_EQ(meter.lost(), 12U) << "heard directly from now on";
}

}  // namespace
}  // namespace crepes::loss_meter_test
