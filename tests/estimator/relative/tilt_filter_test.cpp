#include "estimator/relative/tilt_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::tilt_filter_test {
namespace {

using namespace std::chrono_literals;
using test::RandomGeometry;

TEST(TiltFilter, FindsGravityOnARobotThatStandsStillWithBiasedSensors) {
  RandomGeometry random(1);
  const Eigen::Vector3d up_B = Eigen::Vector3d(0.2, -0.3, 0.9).normalized();
  const Eigen::Vector3d gyro_bias(0.005, -0.004, 0.003);
  TiltFilter filter{ImuNoise{}};
  for (int i = 0; i < 3000; ++i) {
    ASSERT_TRUE(filter.add({Timestamp{i * 10ms}, gyro_bias + random.vector(0.004),
                            kGravityMps2 * up_B + random.vector(0.02)}));
  }

  ASSERT_TRUE(filter.tilt());
  EXPECT_LT(angle_between(filter.tilt()->up_B, up_B), radians(0.3));
  EXPECT_LT(filter.tilt()->sigma_rad, radians(1.0));
  EXPECT_EQ(filter.tilt()->stamp, Timestamp{29990ms});
}

TEST(TiltFilter, CarriesTheAttitudeWhereAMultirotorsAccelerometerAlwaysShowsItsOwnAxis) {
  RandomGeometry random(2);
  TiltFilter filter{ImuNoise{}};
  double squared = 0.0;
  double squared_by_force = 0.0;
  int count = 0;
  const auto attitude = [](double t) {
    // Tilts of up to 17 degrees back and forth: 3 m/s^2, as a robot that flies figures.
    return so3_exp({0.0, 0.0, 0.4 * t}) * so3_exp({0.3 * std::sin(1.7 * t), 0.0, 0.0}) *
           so3_exp({0.0, 0.25 * std::sin(2.1 * t + 1.0), 0.0});
  };
  for (int i = 1; i < 6000; ++i) {
    const double t = 0.01 * i;
    const Eigen::Quaterniond q = attitude(t);
    const Eigen::Vector3d w = so3_log(attitude(t - 0.01).conjugate() * q) / 0.01;
    const Eigen::Vector3d up_B = q.conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d thrust(0.0, 0.0, kGravityMps2 / up_B.z());  // holds its height
    filter.add({Timestamp{i * 10ms}, w + random.vector(0.004), thrust + random.vector(0.05)});
    if (t < 20.0) continue;
    squared += std::pow(angle_between(filter.tilt()->up_B, up_B), 2);
    squared_by_force += std::pow(angle_between(thrust, up_B), 2);
    ++count;
  }

  EXPECT_GT(std::sqrt(squared_by_force / count), radians(5.0));
  EXPECT_LT(std::sqrt(squared / count), radians(4.0));
  EXPECT_LT(squared, squared_by_force / 4.0);
}

// It may lean by 30 degrees where its accelerometer shows its own axis.
TEST(TiltFilter, KnowsLittleOfARobotThatStartsInAFastTurn) {
  const auto sigma_of = [](double rate_radps) {
    TiltFilter filter{ImuNoise{}};
    for (int i = 0; i < 30; ++i)
      filter.add({Timestamp{i * 10ms}, {0.0, 0.0, rate_radps}, {0.0, 0.0, kGravityMps2}});
    return filter.tilt()->sigma_rad;
  };
  EXPECT_LT(sigma_of(0.0), radians(8.0));
  EXPECT_GT(sigma_of(4.0), radians(20.0));
  EXPECT_LT(sigma_of(100.0 / 2.0), radians(30.0));
}

TEST(TiltFilter, SaysNothingBeforeTheFirstSamplesAreAveraged) {
  TiltFilter filter{ImuNoise{}};
  EXPECT_FALSE(filter.tilt());

  filter.add({Timestamp{10ms}, Eigen::Vector3d::Zero(), {0, 0, kGravityMps2}});

  EXPECT_FALSE(filter.tilt());
}

/// A filter that knows which way is up, at 1 s.
TiltFilter settled() {
  TiltFilter filter{ImuNoise{}};
  for (int i = 1; i <= 100; ++i)
    filter.add({Timestamp{i * 10ms}, Eigen::Vector3d::Zero(), {0, 0, kGravityMps2}});
  return filter;
}

TEST(TiltFilter, RefusesWhatIsNotFiniteOrGoesBackAndLosesNothing) {
  TiltFilter filter = settled();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector3d up_before = filter.tilt()->up_B;

  EXPECT_FALSE(filter.add({Timestamp{1010ms}, {nan, 0, 0}, {0, 0, kGravityMps2}}));
  EXPECT_FALSE(filter.add({Timestamp{1010ms}, Eigen::Vector3d::Zero(), {0, nan, kGravityMps2}}));
  EXPECT_FALSE(filter.add({Timestamp{1000ms}, {1, 0, 0}, {kGravityMps2, 0, 0}}));
  EXPECT_FALSE(filter.add({Timestamp{500ms}, {1, 0, 0}, {kGravityMps2, 0, 0}}));

  EXPECT_EQ(filter.tilt()->up_B, up_before);
  EXPECT_TRUE(filter.add({Timestamp{1010ms}, Eigen::Vector3d::Zero(), {0, 0, kGravityMps2}}));
}

TEST(TiltFilter, RefusesWhatNoSensorMeasures) {
  TiltFilter filter = settled();

  EXPECT_FALSE(filter.add({Timestamp{1010ms}, {1e200, 0, 0}, {0, 0, kGravityMps2}}));
  EXPECT_FALSE(filter.add({Timestamp{1010ms}, Eigen::Vector3d::Zero(), {0, 0, 1e200}}));
}

TEST(TiltFilter, StartsAnewAfterAGap) {
  TiltFilter filter = settled();

  EXPECT_TRUE(filter.add({Timestamp{2s}, Eigen::Vector3d::Zero(), {kGravityMps2, 0, 0}}));

  EXPECT_FALSE(filter.tilt());
}

TEST(TiltFilter, AFreeFallTeachesItNothing) {
  TiltFilter filter = settled();
  for (int i = 1; i <= 50; ++i) {
    filter.add({Timestamp{1s + i * 10ms}, Eigen::Vector3d::Zero(), {0.3, 0.0, 0.0}});
  }

  EXPECT_LT(angle_between(filter.tilt()->up_B, Eigen::Vector3d::UnitZ()), radians(0.1));
  EXPECT_GT(filter.tilt()->sigma_rad, settled().tilt()->sigma_rad);
}

}  // namespace
}  // namespace crepes::tilt_filter_test
