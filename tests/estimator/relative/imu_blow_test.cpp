#include "estimator/relative/imu_blow.hpp"

#include <gtest/gtest.h>

namespace crepes::imu_blow_test {
namespace {

using std::chrono::milliseconds;

ImuSample sample(int ms, double rate_radps, double force_mps2) {
  return {.stamp = Timestamp{milliseconds{ms}},
          .gyro_radps = rate_radps * Eigen::Vector3d::UnitZ(),
          .accel_mps2 = {force_mps2, 0.0, 9.81}};
}

/// A blow of so many samples, each with this force and rate, and the believed sample after it.
class Blow {
 public:
  Blow(int samples, double rate_radps, double force_mps2) {
    for (int i = 1; i <= samples; ++i) blow_.add(sample(10 * i, rate_radps, force_mps2), last_);
    after_ = sample(10 * (samples + 1), 0.0, 0.0);
  }
  ImuBlow& end(double reachable_radps = 2.0) {
    blow_.end(after_, last_, reachable_radps);
    return blow_;
  }
  ImuBlow& get() { return blow_; }
  [[nodiscard]] const ImuSample& after() const { return after_; }

 private:
  ImuSample last_ = sample(0, 0.0, 0.0);
  ImuBlow blow_;
  ImuSample after_;
};

TEST(ImuBlow, IsTheIntegralOfTheForcesUpToWhatAWallDoes) {
  Blow weak(3, 0.0, 20.0);
  EXPECT_NEAR(weak.end().velocity_mps(weak.after()).x(), 3 * 0.01 * 20.0, 1e-12);
  EXPECT_TRUE(weak.get().velocity_mps(sample(50, 0.0, 0.0)).isZero()) << "only once";

  Blow hard(3, 0.0, -200.0);
  EXPECT_EQ(hard.end().velocity_mps(hard.after()), Eigen::Vector3d(-1.0, 0.0, 0.0));
}

TEST(ImuBlow, KeepsRatesThatARobotReachesAndTellsHowFarTheyTurn) {
  Blow blow(2, 1.5, 20.0);
  const auto rates = blow.end().rates_before(blow.after());
  ASSERT_EQ(rates.size(), 2U);
  for (const KeptRate& rate : rates) {
    EXPECT_EQ(rate.sample.gyro_radps.z(), 1.5);
    EXPECT_EQ(rate.sample.accel_mps2.x(), 0.0) << "of the believed one before";
    EXPECT_NEAR(rate.turn_rad.z(), 0.01 * 1.5, 1e-12);
  }

  Blow fast(2, 2.5, 20.0);
  EXPECT_TRUE(fast.end().rates_before(fast.after()).empty());
}

TEST(ImuBlow, IsNoneIfItLastsTooLongOrIsForgotten) {
  constexpr int kLongest = ImuBlow::kLongest;
  Blow longest(kLongest, 0.5, 5.0);
  EXPECT_NEAR(longest.end().velocity_mps(longest.after()).x(), 0.01 * 5.0 * kLongest, 1e-12);
  EXPECT_EQ(longest.get().rates_before(longest.after()).size(), ImuBlow::kLongest);

  Blow longer(kLongest + 1, 0.5, 5.0);
  Blow forgotten(2, 0.5, 5.0);
  forgotten.get().forget();
  for (Blow* blow : {&longer, &forgotten}) {
    EXPECT_TRUE(blow->end().velocity_mps(blow->after()).isZero());
    EXPECT_TRUE(blow->get().rates_before(blow->after()).empty());
  }
}

}  // namespace
}  // namespace crepes::imu_blow_test
