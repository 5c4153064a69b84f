#include "daemon/devices/imu_preprocessing.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "estimator/core/constants.hpp"

namespace crepes::imu_preprocessing_test {
namespace {

using namespace std::chrono_literals;

/// Three seconds at rest, of a sensor that shows `force` in its own unit.
ImuPreprocessing after_rest(double force) {
  ImuPreprocessing preprocessing(ImuSensorSettings{.device = {}, .rate_hz = 100.0});
  for (int i = 0; i < 300; ++i) {
    const double noise = 1e-3 * (i % 7);
    std::vector<ImuSample> bundle{{.stamp = Timestamp{i * 10ms},
                                   .gyro_radps = {noise, 0.0, 0.0},
                                   .accel_mps2 = {0.0, 0.0, force + noise}}};
    preprocessing.apply(bundle);
  }
  return preprocessing;
}

TEST(ImuPreprocessing, SaysThatTheAccelerometerReportsAnotherUnit) {
  for (const double force : {1.0, 1000.0}) {  // g and mg
    const auto fault = after_rest(force).diagnosis();
    ASSERT_TRUE(fault) << force;
    EXPECT_NE(fault->find("does not show gravity"), std::string::npos) << *fault;
  }
}

TEST(ImuPreprocessing, FindsNothingWrongWithGravity) {
  const ImuPreprocessing good = after_rest(kGravityMps2);

  EXPECT_EQ(good.diagnosis(), std::nullopt);
  EXPECT_EQ(good.counts().front(), (Totals::value_type{"force_mmps2", 9810}));
}

}  // namespace
}  // namespace crepes::imu_preprocessing_test
