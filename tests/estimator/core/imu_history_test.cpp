#include "estimator/core/imu_history.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "tests/support/random_geometry.hpp"

namespace crepes::imu_history_test {
namespace {

using namespace std::chrono_literals;
using test::RandomGeometry;

ImuSample sample_at(Duration t, double value = 0.0) {
  return {Timestamp{t}, Eigen::Vector3d::Constant(value), Eigen::Vector3d::Constant(2.0 * value)};
}

/// Samples every 10 ms, each the mean of sin(t) over the interval it ends.
ImuHistory sine_history(int count) {
  ImuHistory imu;
  for (int i = 1; i <= count; ++i) {
    const double mean = (std::cos(0.01 * (i - 1)) - std::cos(0.01 * i)) / 0.01;
    imu.push(sample_at(i * 10ms, mean));
  }
  return imu;
}

TEST(ImuHistory, SumsOverWholeSamplesAreTheAnalyticIntegral) {
  const ImuHistory imu = sine_history(100);

  const ImuMean mean = imu.mean(Timestamp{200ms}, Timestamp{700ms});

  const double analytic = (std::cos(0.2) - std::cos(0.7)) / 0.5;
  EXPECT_NEAR(mean.gyro_radps.x(), analytic, 1e-12);
  EXPECT_NEAR(mean.accel_mps2.z(), 2.0 * analytic, 1e-12);
  EXPECT_EQ(mean.extrapolated, 0.0);
}

TEST(ImuHistory, MeansOfPartsAddUpToTheMeanOfTheWhole) {
  const ImuHistory imu = sine_history(100);
  RandomGeometry random(1);
  for (int i = 0; i < 200; ++i) {
    std::array<std::int64_t, 3> t{};
    for (auto& x : t) x = 20'000'000 + random.index(900'000'000);
    std::sort(t.begin(), t.end());
    if (t[0] == t[1] || t[1] == t[2]) continue;
    const auto integral = [&](int from, int to) -> Eigen::Vector3d {
      const Timestamp a{Duration{t[static_cast<std::size_t>(from)]}};
      const Timestamp b{Duration{t[static_cast<std::size_t>(to)]}};
      return imu.mean(a, b).gyro_radps * to_seconds(b - a);
    };

    EXPECT_LT((integral(0, 1) + integral(1, 2) - integral(0, 2)).norm(), 1e-14);
  }
}

/// Stamps in order, as the history keeps them.
std::vector<std::int64_t> stamps_of(const ImuHistory& imu) {
  std::vector<std::int64_t> stamps;
  for (std::size_t i = 0; i < imu.size(); ++i) stamps.push_back(to_ns(imu[i].stamp));
  return stamps;
}

TEST(ImuHistory, KeepsTheNewestDistinctStampsInOrderHoweverTheyArrive) {
  EXPECT_TRUE(rc::check([] {
    const auto arrivals = *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 600));
    ImuHistory imu;
    std::map<std::int64_t, int> expected;  // the same by the slow and simple way
    for (const int t : arrivals) {
      const bool full = expected.size() == ImuHistory::kCapacity;
      const bool refused = expected.contains(t) || (full && t < expected.begin()->first);
      RC_ASSERT(imu.push(sample_at(Duration{t}, 0.1 * t)) == !refused);
      if (refused) continue;
      expected.emplace(t, t);
      if (expected.size() > ImuHistory::kCapacity) expected.erase(expected.begin());
    }

    RC_ASSERT(imu.size() == expected.size());
    std::size_t i = 0;
    for (const auto& [stamp, value] : expected) {
      RC_ASSERT(to_ns(imu[i].stamp) == stamp);
      RC_ASSERT(imu[i].gyro_radps.x() == 0.1 * value);
      ++i;
    }
  }));
}

TEST(ImuHistory, ForgetsTheOldestBeyondItsCapacityAndRefusesWhatIsOlder) {
  constexpr int kForgotten = 44;
  constexpr int kSamples = static_cast<int>(ImuHistory::kCapacity) + kForgotten;
  ImuHistory imu;
  for (int i = 0; i < kSamples; ++i) ASSERT_TRUE(imu.push(sample_at(i * 10ms)));

  EXPECT_EQ(imu.size(), ImuHistory::kCapacity);
  EXPECT_FALSE(imu.push(sample_at(kForgotten * 10ms - 5ms)));
  EXPECT_TRUE(imu.push(sample_at(kForgotten * 10ms + 5ms)));
  EXPECT_EQ(stamps_of(imu).front(), Duration{kForgotten * 10ms + 5ms}.count());
}

TEST(ImuHistory, RefusesDuplicatesAndWhatIsNotFinite) {
  ImuHistory imu;
  ASSERT_TRUE(imu.push(sample_at(10ms, 1.0)));

  EXPECT_FALSE(imu.push(sample_at(10ms, 2.0)));
  EXPECT_FALSE(imu.push(sample_at(20ms, std::numeric_limits<double>::quiet_NaN())));
  EXPECT_FALSE(imu.push(sample_at(20ms, std::numeric_limits<double>::infinity())));
  EXPECT_EQ(imu.size(), 1U);
  EXPECT_EQ(imu.newest().gyro_radps.x(), 1.0);
}

TEST(ImuHistory, RefusesWhatNoSensorMeasures) {
  ImuHistory imu = sine_history(50);

  EXPECT_FALSE(imu.push(sample_at(600ms, 1e200)));

  imu.push(sample_at(610ms));
  imu.push(sample_at(620ms));
  EXPECT_TRUE(std::isfinite(imu.mean(Timestamp{600ms}, Timestamp{620ms}).gyro_noise_density));
}

TEST(ImuHistory, CallsGuessedWhatNoSampleCovers) {
  ImuHistory imu;
  imu.push(sample_at(100ms, 1.0));
  imu.push(sample_at(110ms, 1.0));
  imu.push(sample_at(210ms, 3.0));  // after a gap of 100 ms

  EXPECT_EQ(imu.mean(Timestamp{100ms}, Timestamp{110ms}).extrapolated, 0.0);
  EXPECT_EQ(imu.mean(Timestamp{120ms}, Timestamp{200ms}).extrapolated, 1.0);
  EXPECT_NEAR(imu.mean(Timestamp{105ms}, Timestamp{115ms}).extrapolated, 0.5, 1e-12);
  EXPECT_EQ(imu.mean(Timestamp{0ms}, Timestamp{50ms}).extrapolated, 1.0);
  EXPECT_NEAR(imu.mean(Timestamp{0ms}, Timestamp{50ms}).gyro_radps.x(), 1.0, 1e-12);
  EXPECT_EQ(imu.mean(Timestamp{210ms}, Timestamp{300ms}).extrapolated, 1.0);
  EXPECT_NEAR(imu.mean(Timestamp{1s}, Timestamp{2s}).gyro_radps.x(), 3.0, 1e-12);
}

TEST(ImuHistory, SumsTheTimeThatNoSampleCovers) {
  ImuHistory imu;
  imu.push(sample_at(100ms));
  imu.push(sample_at(110ms));
  imu.push(sample_at(210ms));

  EXPECT_EQ(imu.extrapolated(Timestamp{100ms}, Timestamp{110ms}), 0ms);
  EXPECT_EQ(imu.extrapolated(Timestamp{110ms}, Timestamp{110ms}), 0ms);
  for (const auto& [from, to] : {std::pair{105ms, 160ms}, std::pair{160ms, 105ms}})
    EXPECT_NEAR(to_seconds(imu.extrapolated(Timestamp{from}, Timestamp{to})), 0.05, 1e-9);
}

TEST(ImuHistory, PartsOfABlowAddUpToIt) {
  ImuHistory imu;
  for (int i = 1; i <= 20; ++i) {
    if (i == 10) continue;  // refused
    imu.push(sample_at(i * 10ms),
             i == 11 ? Eigen::Vector3d{0.3, -0.4, 0.0} : Eigen::Vector3d::Zero(),
             i == 11 ? Eigen::Vector3d{0.0, 0.01, 0.02} : Eigen::Vector3d::Zero());
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  for (Timestamp t{2ms}; t < Timestamp{190ms}; t += 7ms) {
    sum += imu.mean(t, t + 7ms).blow_variance_m2ps2;
    turn += imu.mean(t, t + 7ms).turn_variance_rad2;
  }
  EXPECT_LT((sum - Eigen::Vector3d{0.09, 0.16, 0.0}).norm(), 1e-12);
  EXPECT_LT((turn - Eigen::Vector3d{0.0, 1e-4, 4e-4}).norm(), 1e-15);
  EXPECT_TRUE(imu.mean(Timestamp{20ms}, Timestamp{90ms}).blow_variance_m2ps2.isZero());
  EXPECT_TRUE(imu.mean(Timestamp{110ms}, Timestamp{150ms}).blow_variance_m2ps2.isZero());

  // Samples that come late move the others.
  imu.push(sample_at(15ms));
  EXPECT_LT((imu.mean(Timestamp{80ms}, Timestamp{120ms}).blow_variance_m2ps2 -
             Eigen::Vector3d{0.09, 0.16, 0.0})
                .norm(),
            1e-12);
}

// Rotors start: the bias may change by some tens of mm/s^2.
TEST(ImuHistory, PartsOfWhatVibrationDoesToTheBiasAddUpToIt) {
  RandomGeometry random(4);
  ImuHistory imu;
  for (int i = 1; i <= 500; ++i)
    imu.push({Timestamp{i * 10ms}, random.vector(0.01), random.vector(i < 250 ? 0.02 : 1.0)});
  double sum = 0.0;
  for (Timestamp t{2400ms}; t < Timestamp{5s}; t += 4ms)
    sum += imu.mean(t, t + 4ms).bias_variance_m2ps4;
  EXPECT_NEAR(sum, imu.mean(Timestamp{2400ms}, Timestamp{5s}).bias_variance_m2ps4, 1e-12);
  EXPECT_GT(std::sqrt(sum), 0.04);
  EXPECT_LT(std::sqrt(sum), 0.09);
  EXPECT_EQ(imu.mean(Timestamp{1s}, Timestamp{2500ms}).bias_variance_m2ps4, 0.0);
}

TEST(ImuHistory, RotationBackUndoesRotationForth) {
  RandomGeometry random(2);
  ImuHistory imu;
  for (int i = 0; i < 200; ++i) imu.push({Timestamp{i * 10ms}, random.vector(), random.vector()});
  for (int i = 0; i < 100; ++i) {
    const Timestamp a{random.index(2'500) * 1ms};
    const Timestamp b{random.index(2'500) * 1ms};

    const Eigen::Quaterniond loop = imu.rotation(a, b) * imu.rotation(b, a);

    EXPECT_LT(so3_log(loop).norm(), 1e-12);
  }
}

TEST(ImuHistory, RotationIsTheTurnOfABodyAtConstantRate) {
  const Eigen::Vector3d w(0.5, -1.0, 2.0);
  ImuHistory imu;
  for (int i = 0; i < 100; ++i) imu.push({Timestamp{i * 10ms}, w, Eigen::Vector3d::Zero()});

  const Eigen::Quaterniond q = imu.rotation(Timestamp{123ms}, Timestamp{789ms});

  EXPECT_LT((so3_log(q) - 0.666 * w).norm(), 1e-12);
}

/// A hand's swing: samples every 10 ms, each the mean over the interval that it ends.
double swing_mean(double from_s, double to_s) {
  constexpr double kOmega = 7.0;  // rad/s
  return 3.0 * (std::sin(kOmega * to_s) - std::sin(kOmega * from_s)) / kOmega / (to_s - from_s);
}

TEST(ImuHistory, ASwingGoesOnBeyondTheNewestSample) {
  double squares = 0.0;
  double held_squares = 0.0;
  ImuHistory imu;
  for (int i = 1; i < 600; ++i) {
    ASSERT_TRUE(imu.push(sample_at(i * 10ms, swing_mean(0.01 * (i - 1), 0.01 * i))));
    if (i < 200) continue;
    const ImuMean mean = imu.mean(Timestamp{i * 10ms + 10ms}, Timestamp{i * 10ms + 20ms});
    const double truth = swing_mean(0.01 * i + 0.01, 0.01 * i + 0.02);
    squares += std::pow(mean.gyro_radps.x() - truth, 2);
    held_squares += std::pow(imu.newest().gyro_radps.x() - truth, 2);
    EXPECT_NEAR(mean.accel_mps2.y(), 2.0 * mean.gyro_radps.y(), 1e-9);
    EXPECT_EQ(mean.extrapolated, 1.0);
  }
  EXPECT_LT(squares, 0.05 * 0.05 * held_squares);
}

TEST(ImuHistory, HoldsAfterAGapAndForgetsNothing) {
  ImuHistory imu;
  for (int i = 1; i < 300; ++i) imu.push(sample_at(i * 10ms, swing_mean(0.01 * (i - 1), 0.01 * i)));
  const auto ahead = [&imu](Duration by) {
    const Timestamp t = imu.newest().stamp + by;
    return imu.mean(t, t + 1ms).gyro_radps.x();
  };
  EXPECT_NE(ahead(20ms), imu.newest().gyro_radps.x());
  EXPECT_NEAR(ahead(100ms), swing_mean(3.09, 3.091), 0.02);
  EXPECT_EQ(ahead(220ms), ahead(400ms)) << "believed for 210 ms, then held";

  imu.push(sample_at(3040ms, swing_mean(3.03, 3.04)));
  EXPECT_EQ(ahead(20ms), imu.newest().gyro_radps.x());

  for (int i = 305; i < 317; ++i)
    imu.push(sample_at(i * 10ms, swing_mean(0.01 * (i - 1), 0.01 * i)));
  EXPECT_NEAR(ahead(20ms), swing_mean(3.18, 3.181), 0.03) << "of what it had learned before";
}

TEST(ImuHistory, AGapIsBridgedByAStraightLine) {
  ImuHistory imu;
  imu.push(sample_at(100ms, 1.0));
  imu.push(sample_at(300ms, 3.0));

  EXPECT_NEAR(imu.mean(Timestamp{100ms}, Timestamp{300ms}).gyro_radps.x(), 2.0, 1e-12);
  EXPECT_NEAR(imu.mean(Timestamp{140ms}, Timestamp{160ms}).gyro_radps.x(), 1.5, 1e-12);
  const auto error = [&](Duration from, Duration to) {
    return imu.mean(Timestamp{from}, Timestamp{to}).extrapolation_time2_s2 * to_seconds(to - from);
  };
  EXPECT_NEAR(error(100ms, 300ms), std::pow(0.2, 3) / 12.0, 1e-12);
  EXPECT_NEAR(error(100ms, 170ms) + error(170ms, 240ms) + error(240ms, 300ms), error(100ms, 300ms),
              1e-12);
}

/// The error of a turn about one axis over the sigma that it has.
double turn_error(const ImuHistory& imu, Timestamp from, Timestamp to, double true_turn_rad) {
  double turn_rad = 0.0;
  double variance = 0.0;
  for (Timestamp t = from; t < to; t += 10ms) {
    const ImuMean mean = imu.mean(t, t + 10ms);
    turn_rad += mean.gyro_radps.x() * 0.01;
    variance += std::pow(mean.gyro_innovation_density, 2) * mean.extrapolation_time2_s2 * 0.01;
  }
  return (turn_rad - true_turn_rad) / std::sqrt(variance);
}

/// The errors of turns without samples for so long, after a gap and so many samples.
double rms_turn_error(Duration gap, int samples, Duration unknown) {
  double sum = 0.0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    ImuHistory imu;
    const Duration end = 3s + trial * 10ms;
    const auto push = [&imu](Duration t) {
      imu.push(sample_at(t, swing_mean(to_seconds(t - 10ms), to_seconds(t))));
    };
    Duration t = 10ms;
    for (; t <= end; t += 10ms) push(t);
    t += gap;
    for (int i = 0; i < samples; ++i, t += 10ms) push(t);
    const Timestamp newest = imu.newest().stamp;
    const double from_s = to_seconds(newest.time_since_epoch());
    const double unknown_s = to_seconds(unknown);
    sum += std::pow(turn_error(imu, newest, newest + unknown,
                               unknown_s * swing_mean(from_s, from_s + unknown_s)),
                    2);
  }
  return std::sqrt(sum / kTrials);
}

TEST(ImuHistory, TurnsThatNoSampleShowsErrAsTheySay) {
  for (const Duration unknown : {100ms, 200ms, 300ms, 400ms}) {
    EXPECT_LT(rms_turn_error(0ms, 0, unknown), 2.0) << to_seconds(unknown);
    for (const int samples : {1, 5, 12})
      EXPECT_LT(rms_turn_error(200ms, samples, unknown), 1.5) << to_seconds(unknown);
  }
}

TEST(ImuHistory, ARateThatTheModelHasNotSeenIsHeld) {
  ImuHistory imu;
  const auto expect_held = [&imu](int first, int last, double rate) {
    for (int i = first; i < last; ++i) {
      imu.push(sample_at(i * 10ms, rate));
      const Timestamp t = imu.newest().stamp + 20ms;
      EXPECT_EQ(imu.mean(t, t + 1ms).gyro_radps.x(), rate) << i;
    }
  };

  expect_held(1, 120, 1.8);     // turning since before the first sample
  expect_held(150, 180, -0.9);  // and another way, after a gap
}

TEST(ImuHistory, AConstantIsPredictedToTheBit) {
  ImuHistory imu;
  for (int i = 1; i < 300; ++i) imu.push(sample_at(i * 10ms, 0.7));

  EXPECT_EQ(imu.mean(Timestamp{3s}, Timestamp{3020ms}).gyro_radps.x(), 0.7);
}

TEST(ImuHistory, ReadsTheWhiteNoiseOffTheSamples) {
  RandomGeometry random(3);
  ImuHistory imu;
  for (int i = 0; i < 250; ++i) {
    const Eigen::Vector3d slow = std::sin(0.02 * i) * Eigen::Vector3d::Ones();
    imu.push({Timestamp{i * 10ms}, slow + random.vector(0.01), slow + random.vector(0.3)});
  }

  const ImuMean mean = imu.mean(Timestamp{2s}, Timestamp{2100ms});

  // sigma of a sample times the root of its period; 50 effective samples of three axes: 10 %.
  EXPECT_NEAR(mean.gyro_noise_density / (0.01 * 0.1), 1.0, 0.3);
  EXPECT_NEAR(mean.accel_noise_density / (0.3 * 0.1), 1.0, 0.3);
}

TEST(ImuHistory, KeepsASecondOfTheFastestImu) {
  ImuHistory imu;
  for (int ms = 0; ms <= 3000; ++ms) imu.push({.stamp = Timestamp{std::chrono::milliseconds{ms}}});

  const Timestamp newest = imu.newest().stamp;
  EXPECT_EQ(imu.extrapolated(newest - std::chrono::seconds{1}, newest), Duration{});
}

}  // namespace
}  // namespace crepes::imu_history_test
