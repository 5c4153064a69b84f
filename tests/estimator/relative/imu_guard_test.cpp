#include "estimator/relative/imu_guard.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::imu_guard_test {
namespace {

using namespace std::chrono_literals;
using test::RandomGeometry;

constexpr Duration kPeriod = 10ms;
constexpr int kSecond = 100;  // samples

/// How a robot moves and shakes.
struct Motion {
  const char* name;
  double swing_rad;  ///< amplitude of its attitude
  double swing_hz;
  double gyro_noise;   ///< of a sample, with vibration [rad/s]
  double accel_noise;  ///< [m/s^2]
};

constexpr std::array kMotions{
    Motion{"at rest", 0.0, 0.0, 0.0026, 0.018}, Motion{"flying", 0.2, 0.3, 0.01, 0.02},
    Motion{"vibrating", 0.2, 0.5, 0.1, 3.0},
    Motion{"swung by hand", 0.8, 1.0, 0.004, 0.02},  // 1800 deg/s^2
};

/// Mean rates over the periods that end at the stamps.
std::vector<ImuSample> samples_of(const Motion& motion, std::uint64_t seed, int count) {
  RandomGeometry random(seed);
  const double omega = 2.0 * std::numbers::pi * motion.swing_hz;
  const Eigen::Vector3d axis = random.direction();
  const double phase = random.uniform(-3.0, 3.0);
  const auto attitude = [&](double t) {
    return so3_exp(motion.swing_rad * std::sin(omega * t + phase) * axis);
  };
  std::vector<ImuSample> samples;
  const double dt = to_seconds(kPeriod);
  for (int i = 1; i <= count; ++i) {
    const double t = dt * i;
    samples.push_back({Timestamp{i * kPeriod},
                       so3_log(attitude(t - dt).conjugate() * attitude(t)) / dt +
                           random.vector(motion.gyro_noise),
                       attitude(t - 0.5 * dt).conjugate() * Eigen::Vector3d(0, 0, kGravityMps2) +
                           random.vector(motion.accel_noise)});
  }
  return samples;
}

/// What a sensor makes of a sample.
using Damage = void (*)(ImuSample&);

struct NamedDamage {
  const char* name;
  Damage apply;
};

void swap_axes(ImuSample& s) {
  s.gyro_radps = {s.gyro_radps.y(), s.gyro_radps.z(), s.gyro_radps.x()};
  s.accel_mps2 = {s.accel_mps2.y(), s.accel_mps2.z(), s.accel_mps2.x()};
}

constexpr std::array kDamages{
    NamedDamage{"gyroscope at its end", [](ImuSample& s) { s.gyro_radps.y() = 34.9; }},
    NamedDamage{"gyroscope spike", [](ImuSample& s) { s.gyro_radps.x() += 4.0; }},
    NamedDamage{"accelerometer at its end", [](ImuSample& s) { s.accel_mps2.x() = -156.9; }},
    NamedDamage{"both", [](ImuSample& s) { s.gyro_radps *= -20.0, s.accel_mps2 *= -7.0; }},
};
constexpr std::array kSmallDamages{
    // Hidden by a vibration of 3 m/s^2.
    NamedDamage{"accelerometer in g", [](ImuSample& s) { s.accel_mps2 /= kGravityMps2; }},
    NamedDamage{"axes swapped", swap_axes},
};

/// The samples that a guard believes.
std::vector<ImuSample> believed_of(ImuGuard& guard, const std::vector<ImuSample>& samples) {
  std::vector<ImuSample> all;
  for (const ImuSample& sample : samples) {
    const auto believed = guard.accept(sample);
    all.insert(all.end(), believed.begin(), believed.end());
  }
  return all;
}

std::uint64_t count(const ImuGuard& guard, ImuFault fault) {
  return guard.refused().at(static_cast<std::size_t>(fault));
}

TEST(ImuGuard, BelievesEveryHealthySample) {
  for (const Motion& motion : kMotions) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      ImuGuard guard;
      const auto samples = samples_of(motion, seed, 30 * kSecond);

      EXPECT_EQ(believed_of(guard, samples).size(), samples.size()) << motion.name << ' ' << seed;
    }
  }
}

/// Damages a sample at random, once or twice a second, and counts which are believed.
void expect_spikes_refused(const Motion& motion, const NamedDamage& damage, std::uint64_t seed) {
  RandomGeometry random(seed);
  auto samples = samples_of(motion, seed, 60 * kSecond);
  std::vector<Timestamp> damaged;
  for (std::size_t i = kSecond; i + kSecond < samples.size();) {
    damage.apply(samples[i]);
    damaged.push_back(samples[i].stamp);
    i += 50 + static_cast<std::size_t>(random.index(50));
  }
  ImuGuard guard;

  const auto believed = believed_of(guard, samples);

  std::size_t missed = 0;
  for (const ImuSample& sample : believed)
    missed += std::ranges::binary_search(damaged, sample.stamp) ? 1U : 0U;
  EXPECT_EQ(missed, 0U) << motion.name << ' ' << damage.name << ' ' << seed;
  // No more than one in fifty healthy ones beside a damaged one is lost with it.
  const std::size_t healthy = samples.size() - damaged.size();
  EXPECT_GE(believed.size() - missed + damaged.size() / 50, healthy) << motion.name;
  EXPECT_EQ(count(guard, ImuFault::kSpike), samples.size() - believed.size());
}

TEST(ImuGuard, RefusesADamagedSampleAndNoOther) {
  for (const Motion& motion : kMotions) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed)
      for (const NamedDamage& damage : kDamages) expect_spikes_refused(motion, damage, seed);
  }
}

TEST(ImuGuard, RefusesSmallDamageWhereNothingVibrates) {
  for (const Motion& motion : kMotions) {
    if (motion.accel_noise > 1.0) continue;
    for (std::uint64_t seed = 1; seed <= 5; ++seed)
      for (const NamedDamage& damage : kSmallDamages) expect_spikes_refused(motion, damage, seed);
  }
}

TEST(ImuGuard, ADamagedSampleIsNotBelievedForAMoment) {
  auto samples = samples_of(kMotions[1], 1, 2 * kSecond);
  samples[150].gyro_radps.x() = 34.9;
  ImuGuard guard;
  for (std::size_t i = 0; i < 150; ++i) EXPECT_EQ(guard.accept(samples[i]).size(), 1U);

  EXPECT_TRUE(guard.accept(samples[150]).empty());
  ASSERT_EQ(guard.accept(samples[151]).size(), 1U);
  EXPECT_EQ(guard.accept(samples[152]).front().stamp, samples[152].stamp);
}

TEST(ImuGuard, TellsWhatARefusedForceWouldHaveDone) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto samples = samples_of(kMotions[0], seed, 3 * kSecond);
    samples[150].accel_mps2 += Eigen::Vector3d{30.0, -20.0, 0.0};  // a blow over two samples
    samples[151].accel_mps2 += Eigen::Vector3d{20.0, 0.0, 0.0};
    samples[200].accel_mps2.z() -= 900.0;
    ImuGuard guard;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      for (const ImuSample& believed : guard.accept(samples[i])) {
        const Eigen::Vector3d blow = guard.blow_mps(believed);
        if (believed.stamp == samples[152].stamp) {
          EXPECT_LT((blow - Eigen::Vector3d{0.5, -0.2, 0.0}).norm(), 0.05) << seed;
        } else if (believed.stamp == samples[201].stamp) {
          EXPECT_EQ(blow.z(), -1.0) << seed;  // no robot is hit harder
        } else {
          EXPECT_EQ(blow, Eigen::Vector3d::Zero().eval()) << seed << ' ' << i;
        }
      }
    }
    ASSERT_EQ(guard.spikes().size(), 3U) << seed;
    EXPECT_EQ(guard.spikes()[1].accel_mps2, samples[151].accel_mps2);
  }
}

// A wheel hits a stone: the robot shakes within a sample or two, and its rate with it.
TEST(ImuGuard, KeepsTheRatesOfABlow) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto samples = samples_of(kMotions[1], seed, 3 * kSecond);
    for (std::size_t i = 150; i < samples.size(); ++i) {
      const double t = 0.01 * static_cast<double>(i - 149);
      const double swing = std::exp(-10.0 * t) * std::sin(2.0 * std::numbers::pi * 10.0 * t);
      samples[i].gyro_radps += swing * Eigen::Vector3d{1.5, -1.0, 0.0};
      samples[i].accel_mps2.z() += 25.0 * swing;
    }
    ImuGuard guard;
    std::vector<ImuSample> history;
    std::size_t kept = 0;
    for (const ImuSample& sample : samples) {
      for (const ImuSample& believed : guard.accept(sample)) {
        for (const KeptRate& rate : guard.rates_before(believed)) {
          history.push_back(rate.sample);
          EXPECT_LT(rate.turn_rad.norm(), 0.03) << seed;
          ++kept;
        }
        history.push_back(believed);
      }
    }
    EXPECT_GE(kept, 3U) << seed;
    ASSERT_EQ(history.size(), samples.size()) << seed;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      EXPECT_EQ(history[i].stamp, samples[i].stamp) << seed;
      EXPECT_EQ(history[i].gyro_radps, samples[i].gyro_radps) << seed;
    }
  }
}

TEST(ImuGuard, KeepsADamagedRateThatARobotReachesAndTellsWhatItDoes) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto samples = samples_of(kMotions[0], seed, 3 * kSecond);
    samples[150].gyro_radps.y() += 1.0;
    samples[200].gyro_radps.y() += 4.0;
    ImuGuard guard;
    std::vector<KeptRate> kept;
    for (const ImuSample& sample : samples) {
      for (const ImuSample& believed : guard.accept(sample)) {
        const auto rates = guard.rates_before(believed);
        kept.insert(kept.end(), rates.begin(), rates.end());
      }
    }
    ASSERT_EQ(kept.size(), 1U) << seed;
    EXPECT_EQ(kept[0].sample.stamp, samples[150].stamp) << seed;
    EXPECT_EQ(kept[0].sample.accel_mps2, samples[149].accel_mps2) << seed;
    EXPECT_NEAR(kept[0].turn_rad.y(), 0.01, 1e-3) << seed;
  }
}

TEST(ImuGuard, ALandingCostsNoMoreThanItsSamples) {
  // Forces of a multirotor that sets down within 60 ms. Some of them may be believed.
  constexpr std::array kForces{0.6, 3.5, 11.1, 17.4, 14.5, 6.2, 1.3, 0.4};
  for (const double vibration : {0.0, 0.1, 0.2, 0.3, 0.4, 0.6}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      RandomGeometry random(seed);
      auto samples = samples_of(kMotions[1], seed, 3 * kSecond);
      for (ImuSample& sample : samples) sample.accel_mps2 += random.vector(vibration);
      for (std::size_t i = 0; i < kForces.size(); ++i)
        samples[150 + i].accel_mps2.z() += kForces.at(i);
      ImuGuard guard;
      const std::size_t believed = believed_of(guard, samples).size();

      EXPECT_GE(believed + kForces.size(), samples.size()) << vibration << ' ' << seed;
      EXPECT_EQ(count(guard, ImuFault::kJump), 0U) << vibration << ' ' << seed;
      // Within 40 ms after it.
      ImuGuard again;
      std::size_t soon = 0;
      for (std::size_t i = 0; i < 150 + kForces.size() + 4; ++i)
        soon += again.accept(samples[i]).size();
      EXPECT_GE(soon, 150U + 3U) << vibration << ' ' << seed;
    }
  }
}

TEST(ImuGuard, RemembersTheLatestSpikesOnly) {
  auto samples = samples_of(kMotions[0], 1, 60 * kSecond);
  for (std::size_t i = 1; i <= 50; ++i) samples[i * kSecond].gyro_radps.x() = 34.9;
  ImuGuard guard;
  believed_of(guard, samples);
  ASSERT_FALSE(guard.spikes().empty());
  EXPECT_LE(guard.spikes().size(), 20U);
  EXPECT_EQ(guard.spikes().back().stamp, samples[50 * kSecond].stamp);
}

TEST(ImuGuard, AChangeThatStaysIsBelievedASampleLate) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto samples = samples_of(kMotions[0], seed, 2 * kSecond);
    for (std::size_t i = 150; i < samples.size(); ++i) samples[i].gyro_radps.z() += 1.5;
    ImuGuard guard;
    std::size_t believed = 0;
    for (std::size_t i = 0; i < 152; ++i) believed += guard.accept(samples[i]).size();

    EXPECT_EQ(believed, 152U) << seed;
  }
}

TEST(ImuGuard, ABlowIsBelieved) {
  // The force of a collision ends with it; the rate that it causes stays.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto samples = samples_of(kMotions[1], seed, 3 * kSecond);
    samples[150].accel_mps2.x() += 60.0;
    for (std::size_t i = 150; i < samples.size(); ++i) samples[i].gyro_radps.y() += 0.5;
    ImuGuard guard;

    EXPECT_EQ(believed_of(guard, samples).size(), samples.size()) << seed;
  }
}

// From stillness to a vibration of 3 m/s^2.
TEST(ImuGuard, LosesFewSamplesWhenRotorsStart) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto samples = samples_of(kMotions[0], seed, 4 * kSecond);
    const auto vibrating = samples_of(kMotions[2], seed, 4 * kSecond);
    for (std::size_t i = 200; i < samples.size(); ++i) {
      const double share = std::min(1.0, 0.01 * static_cast<double>(i - 200));  // in a second
      samples[i].gyro_radps += share * vibrating[i].gyro_radps;
      samples[i].accel_mps2 +=
          share * (vibrating[i].accel_mps2 - kGravityMps2 * Eigen::Vector3d::UnitZ());
    }
    ImuGuard guard;

    EXPECT_GE(believed_of(guard, samples).size() + 25, samples.size()) << seed;
  }
}

/// A fault of a second, and how long after it samples are believed again.
void expect_return(const Motion& motion, const NamedDamage& damage, std::uint64_t seed) {
  auto samples = samples_of(motion, seed, 6 * kSecond);
  constexpr std::size_t kBegin = 3 * kSecond;
  constexpr std::size_t kEnd = 4 * kSecond;
  for (std::size_t i = kBegin; i < kEnd; ++i) damage.apply(samples[i]);
  ImuGuard guard;

  std::size_t damaged = 0;
  std::size_t back = samples.size();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (const ImuSample& believed : guard.accept(samples[i])) {
      if (believed.stamp >= samples[kBegin].stamp && believed.stamp < samples[kEnd].stamp)
        ++damaged;
      if (believed.stamp >= samples[kEnd].stamp) back = std::min(back, i);
    }
  }

  EXPECT_EQ(damaged, 0U) << motion.name << ' ' << damage.name << ' ' << seed;
  EXPECT_LE(back, kEnd + 25) << motion.name << ' ' << damage.name << ' ' << seed;
}

TEST(ImuGuard, AnotherUnitIsNotBelievedWhileItLastsAndTheRightOneSoonAfter) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const std::size_t motion : {0U, 1U, 3U})
      expect_return(kMotions.at(motion), kSmallDamages[0], seed);
    expect_return(kMotions[3],
                  {"gyroscope in degrees", [](ImuSample& s) { s.gyro_radps *= kDegPerRad; }}, seed);
  }
}

TEST(ImuGuard, SwappedAxesAreNotBelieved) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    for (const std::size_t motion : {0U, 1U})
      expect_return(kMotions.at(motion), kSmallDamages[1], seed);
}

TEST(ImuGuard, OfTwoSeriesThatContradictEachOtherTheLongerIsBelieved) {
  constexpr std::size_t kGap = 2 * kSecond;
  constexpr std::size_t kBegin = 3 * kSecond;  // of swapped axes, the first after a gap
  for (const std::size_t swapped : {kSecond / 3, kSecond}) {
    const std::size_t end = kBegin + swapped;
    auto samples = samples_of(kMotions[0], 1, end + 6 * kSecond);
    std::for_each(samples.begin() + kBegin, samples.begin() + end, swap_axes);
    samples.erase(samples.begin() + kGap, samples.begin() + kBegin);
    const Timestamp right = samples.at(kGap + swapped).stamp;
    const Duration lasted = samples.at(kGap + swapped - 1).stamp - samples.at(kGap).stamp;
    ImuGuard guard;

    const auto believed = believed_of(guard, samples);

    const auto back = std::ranges::find_if(
        believed, [&](const ImuSample& sample) { return sample.stamp >= right; });
    ASSERT_NE(back, believed.end());
    EXPECT_GE(back->stamp - right, lasted - 20ms);
    EXPECT_LE(back->stamp - right, lasted + 20ms);
  }
}

TEST(ImuGuard, GarbageIsNotBelieved) {
  static RandomGeometry random(7);
  const NamedDamage garbage{"garbage", [](ImuSample& s) {
                              s.gyro_radps = random.vector(20.0);
                              s.accel_mps2 = random.vector(80.0);
                            }};
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    for (const Motion& motion : kMotions) expect_return(motion, garbage, seed);
}

TEST(ImuGuard, RefusesWhatNoSensorMeasures) {
  ImuGuard guard;
  ImuSample sample{Timestamp{10ms}, Eigen::Vector3d::Zero(), {0.0, 0.0, kGravityMps2}};
  sample.gyro_radps.x() = std::numeric_limits<double>::quiet_NaN();

  EXPECT_TRUE(guard.accept(sample).empty());
  EXPECT_EQ(count(guard, ImuFault::kImplausible), 1U);
}

// In units of g from the beginning, where nothing changes. A fall of half a second is too short to
// be another unit, whatever else is said of it.
TEST(ImuGuard, WithoutGravityNothingIsBelieved) {
  const std::vector<ImuSample> samples = samples_of(kMotions[1], 1, 8 * kSecond);
  const auto after = [&](double scale, int from, int to) {
    ImuGuard guard;
    for (int i = 0; i < static_cast<int>(samples.size()); ++i) {
      ImuSample sample = samples[static_cast<std::size_t>(i)];
      if (i >= from && i < to) sample.accel_mps2 *= scale;
      static_cast<void>(guard.accept(sample));
    }
    return count(guard, ImuFault::kImplausible);
  };
  EXPECT_EQ(after(1.0 / kGravityMps2, 0, 8 * kSecond), samples.size());
  EXPECT_EQ(after(0.05, 4 * kSecond, 4 * kSecond + kSecond / 2), 0U);
}

// As after a reboot: what was refused by another clock says nothing.
TEST(ImuGuard, GravityIsSeenAgainWhenTheClockHasGoneBack) {
  const std::vector<ImuSample> samples = samples_of(kMotions[1], 1, 2 * kSecond);
  ImuGuard guard;
  for (ImuSample sample : samples) {
    sample.stamp += 1h;
    sample.accel_mps2 /= kGravityMps2;
    EXPECT_TRUE(guard.accept(sample).empty());
  }
  std::size_t believed = 0;
  for (const ImuSample& sample : samples) believed += guard.accept(sample).size();
  EXPECT_GT(believed, samples.size() - 30);
}

TEST(ImuGuard, PassesALateSampleOn) {
  const auto samples = samples_of(kMotions[1], 1, 2 * kSecond);
  ImuGuard guard;
  for (const ImuSample& sample : samples)
    if (sample.stamp != samples[150].stamp) static_cast<void>(guard.accept(sample));

  const auto late = guard.accept(samples[150]);

  ASSERT_EQ(late.size(), 1U);
  EXPECT_TRUE(guard.agrees(late.front(), {.gyro_radps = samples[149].gyro_radps,
                                          .accel_mps2 = samples[149].accel_mps2}));
  ImuSample bad = samples[150];
  bad.gyro_radps.x() = 34.9;
  EXPECT_FALSE(guard.agrees(
      bad, {.gyro_radps = samples[149].gyro_radps, .accel_mps2 = samples[149].accel_mps2}));
}

TEST(ImuGuard, ForgetsThePredictionInAGap) {
  const auto before = samples_of(kMotions[0], 1, 2 * kSecond);
  ImuGuard guard;
  static_cast<void>(believed_of(guard, before));
  ImuSample after = before.back();
  after.stamp += 300ms;
  after.gyro_radps.x() += 1.0;

  EXPECT_EQ(guard.accept(after).size(), 1U);
}

// Else it would stand for the force until the next one is believed: a shock that rings lasts 0.2 s.
TEST(ImuGuard, DoesNotBelieveAPartOfABlowThatAGapEndsWith) {
  const auto before = samples_of(kMotions[0], 1, 2 * kSecond);
  ImuGuard guard;
  static_cast<void>(believed_of(guard, before));
  ImuSample blow = before.back();
  blow.stamp += 120ms;
  blow.accel_mps2.z() -= 15.0;
  ImuSample after = before.back();
  after.stamp = blow.stamp + kPeriod;

  EXPECT_TRUE(guard.accept(blow).empty());
  EXPECT_EQ(guard.accept(after).size(), 1U);
  EXPECT_LT(guard.blow_mps(after).z(), 0.0);
}

}  // namespace
}  // namespace crepes::imu_guard_test
