#include "drivers/iio/triad_pairing.hpp"

#include <gtest/gtest.h>

namespace crepes::triad_pairing_test {
namespace {

using namespace std::chrono_literals;

StampedTriad at(Duration time, double value) {
  return {Timestamp{time}, Eigen::Vector3d::Constant(value)};
}

TEST(TriadPairing, InterpolatesAccelerationsAtTheTimesOfRates) {
  TriadPairing pairing(20ms);
  pairing.add_acceleration(at(0ms, 0.0));
  pairing.add_acceleration(at(10ms, 10.0));
  pairing.add_acceleration(at(20ms, 30.0));
  for (const Duration time : {2ms, 10ms, 15ms, 20ms}) pairing.add_rate(at(time, 1.0));

  const auto samples = pairing.drain();

  ASSERT_EQ(samples.size(), 4U);
  EXPECT_NEAR(samples[0].accel_mps2.x(), 2.0, 1e-12);
  EXPECT_NEAR(samples[1].accel_mps2.x(), 10.0, 1e-12);
  EXPECT_NEAR(samples[2].accel_mps2.x(), 20.0, 1e-12);
  EXPECT_NEAR(samples[3].accel_mps2.x(), 30.0, 1e-12);
  EXPECT_EQ(samples[2].stamp, Timestamp{15ms});
  EXPECT_EQ(pairing.unpaired(), 0U);
}

TEST(TriadPairing, WaitsForTheNextAcceleration) {
  TriadPairing pairing(20ms);
  pairing.add_acceleration(at(0ms, 0.0));
  pairing.add_rate(at(5ms, 1.0));
  EXPECT_TRUE(pairing.drain().empty());

  pairing.add_acceleration(at(10ms, 10.0));

  EXPECT_EQ(pairing.drain().size(), 1U);
}

TEST(TriadPairing, CountsRatesThatFallIntoAGap) {
  TriadPairing pairing(20ms);
  pairing.add_acceleration(at(0ms, 0.0));
  pairing.add_acceleration(at(30ms, 0.0));
  pairing.add_acceleration(at(40ms, 0.0));
  for (const Duration time : {10ms, 35ms}) pairing.add_rate(at(time, 1.0));

  EXPECT_EQ(pairing.drain().size(), 1U);
  EXPECT_EQ(pairing.unpaired(), 1U);
}

TEST(TriadPairing, DoesNotCountRatesBeforeTheFirstAcceleration) {
  TriadPairing pairing(20ms);
  for (const Duration time : {1ms, 2ms, 12ms}) pairing.add_rate(at(time, 1.0));
  pairing.add_acceleration(at(10ms, 0.0));
  pairing.add_acceleration(at(20ms, 0.0));

  EXPECT_EQ(pairing.drain().size(), 1U);
  EXPECT_EQ(pairing.unpaired(), 0U);
}

TEST(TriadPairing, StandsEqualStamps) {
  TriadPairing pairing(20ms);
  for (int i = 0; i < 3; ++i) pairing.add_acceleration(at(10ms, 7.0));
  pairing.add_rate(at(10ms, 1.0));

  const auto samples = pairing.drain();

  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].accel_mps2.x(), 7.0);
}

TEST(TriadPairing, GivesUpOnASilentAccelerometer) {
  TriadPairing pairing(20ms);
  for (int i = 0; i < 1000; ++i) {
    pairing.add_rate(at(i * 5ms, 1.0));
    EXPECT_TRUE(pairing.drain().empty());
  }
  EXPECT_EQ(pairing.unpaired(), 1000U - 256U);
}

}  // namespace
}  // namespace crepes::triad_pairing_test
