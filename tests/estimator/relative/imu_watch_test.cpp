#include "estimator/relative/imu_watch.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"

namespace crepes::imu_watch_test {
namespace {

using namespace std::chrono_literals;
using test::RandomGeometry;

/// Sample `i` of a body at rest, in steps of a coarse sensor: 1 mrad/s and 5 mm/s^2.
ImuSample resting(RandomGeometry& random, int i) {
  const auto stepped = [](const Eigen::Vector3d& v, double step) -> Eigen::Vector3d {
    return step * (v / step).array().round();
  };
  return {Timestamp{i * 10ms}, stepped(random.vector(0.0026), 0.001),
          Eigen::Vector3d(0, 0, 9.805) + stepped(random.vector(0.018), 0.005)};
}

TEST(ImuWatch, AcceptsACoarseSensorAtRestForAnHour) {
  RandomGeometry random(1);
  ImuWatch watch;
  int refused = 0;
  for (int i = 0; i < 360'000; ++i) refused += watch.accept(resting(random, i)) ? 0 : 1;

  EXPECT_EQ(refused, 0);
}

TEST(ImuWatch, RefusesTheSameSixNumbersFromTheEleventhOn) {
  RandomGeometry random(2);
  ImuWatch watch;
  ImuSample sample = resting(random, 0);
  int accepted = 0;
  for (int i = 0; i < 100; ++i) {
    sample.stamp = Timestamp{i * 10ms};
    accepted += watch.accept(sample) ? 1 : 0;
  }

  EXPECT_EQ(accepted, 10);
  EXPECT_FALSE(watch.is_saturated());
  EXPECT_TRUE(watch.accept(resting(random, 100)));
}

TEST(ImuWatch, RefusesAnAxisThatHangsWhileOthersMove) {
  RandomGeometry random(4);
  for (const int axis : {0, 1, 2}) {
    ImuWatch watch;
    for (int i = 0; i < 1000; ++i) EXPECT_TRUE(watch.accept(resting(random, i)));
    int accepted = 0;
    for (int i = 1000; i < 1100; ++i) {
      ImuSample sample = resting(random, i);
      sample.gyro_radps += random.vector(0.1);
      sample.gyro_radps(axis) = 0.123;
      accepted += watch.accept(sample) ? 1 : 0;
    }

    EXPECT_LT(accepted, 40) << axis;  // this coarse sensor repeats one sample in six at rest
    EXPECT_TRUE(watch.accept(resting(random, 1100)));
  }
}

TEST(ImuWatch, RefusesAnAxisAtTheEndOfItsRangeWhileOthersMove) {
  RandomGeometry random(3);
  ImuWatch watch;
  int accepted = 0;
  for (int i = 0; i < 20; ++i) {
    ImuSample sample = resting(random, i);
    sample.gyro_radps.y() = -4.36;
    accepted += watch.accept(sample) ? 1 : 0;
  }

  EXPECT_EQ(accepted, 4);
  EXPECT_TRUE(watch.is_saturated());
  EXPECT_TRUE(watch.accept(resting(random, 20)));
  EXPECT_FALSE(watch.is_saturated());
}

/// How many samples are refused of a second of a sensor at 1 kHz that measures anew every `period`.
int refused_of(Duration period, double rate_radps) {
  RandomGeometry random(5);
  ImuWatch watch;
  ImuSample measured;
  int refused = 0;
  for (Timestamp t{}; t < Timestamp{1s}; t += 1ms) {
    if (t.time_since_epoch() % period == Duration{}) {
      measured = resting(random, 0);
      measured.gyro_radps.z() += rate_radps;
    }
    measured.stamp = t;
    refused += watch.accept(measured) ? 0 : 1;
  }
  return refused;
}

TEST(ImuWatch, ASensorThatIsReadMoreOftenThanItMeasuresDoesNotHang) {
  EXPECT_EQ(refused_of(20ms, 0.0), 0);
  EXPECT_GT(refused_of(200ms, 0.0), 500);
}

TEST(ImuWatch, ASensorThatIsReadMoreOftenThanItMeasuresIsNotSaturatedByATurn) {
  EXPECT_EQ(refused_of(10ms, 3.0), 0);
}

TEST(ImuWatch, KnowsTheEndOfTheRangeOfASensorThatIsReadMoreOftenThanItMeasures) {
  RandomGeometry random(6);
  ImuWatch watch;
  ImuSample sample;
  for (int i = 0; i < 100; ++i) {
    if (i % 10 == 0) sample = resting(random, 0);
    sample.stamp = Timestamp{i * 1ms};
    sample.gyro_radps.y() = -4.36;
    static_cast<void>(watch.accept(sample));
  }

  EXPECT_TRUE(watch.is_saturated());
}

}  // namespace
}  // namespace crepes::imu_watch_test
