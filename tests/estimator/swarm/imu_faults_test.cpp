// One damaged inertial sample, and longer faults of an IMU: what they cost two simulated robots.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "estimator/core/constants.hpp"
#include "tests/support/estimator_pair.hpp"

namespace crepes::imu_faults_test {
namespace {

using namespace std::chrono_literals;
using test::Conditions;
using test::EstimatorPair;
using test::RandomGeometry;

constexpr Duration kWarmUp = 4s;

struct Damage {
  const char* name;
  void (*apply)(ImuSample&);
};

constexpr std::array kDamages{
    Damage{"gyroscope at its end", [](ImuSample& s) { s.gyro_radps.z() = 34.9; }},
    Damage{"gyroscope in degrees", [](ImuSample& s) { s.gyro_radps *= kDegPerRad; }},
    Damage{"accelerometer at its end", [](ImuSample& s) { s.accel_mps2.y() = 156.9; }},
    Damage{"accelerometer in g", [](ImuSample& s) { s.accel_mps2 /= kGravityMps2; }},
};

Conditions with_damage(bool own, const std::function<ImuSample(const ImuSample&)>& damage) {
  Conditions conditions;
  (own ? conditions.own_imu : conditions.peer_imu) = damage;
  return conditions;
}

/// The instants at which single samples of either robot are damaged: one a second.
constexpr int kInstants = 10;

/// Runs a pair through the instants; without `damage` nothing happens at them.
EstimatorPair run_through(std::uint64_t seed, const Damage* damage) {
  EstimatorPair pair(seed);
  RandomGeometry random(seed);
  pair.run_for(kWarmUp);
  for (int i = 0; i < kInstants; ++i) {
    const Duration before = 10ms * random.index(50);
    pair.run_for(before);
    const auto once = [damage](const ImuSample& sample) {
      ImuSample read = sample;
      if (damage != nullptr) damage->apply(read);
      return read;
    };
    pair.run_for(10ms, with_damage(i % 2 == 0, once));  // one sample
    pair.run_for(1s - before - 10ms);
  }
  return pair;
}

double root_mean_square_m(const EstimatorPair& pair, Duration from, Duration to) {
  double sum = 0.0;
  int count = 0;
  for (const EstimatorPair::Found& found : pair.found()) {
    if (found.at <= from || found.at > to) continue;
    sum += found.error.head<3>().squaredNorm();
    ++count;
  }
  return std::sqrt(sum / std::max(count, 1));
}

/// Position only.
int beyond_five_sigma(const EstimatorPair& pair) {
  constexpr double kQuantile = 35.0;
  return static_cast<int>(std::ranges::count_if(pair.found(), [](const auto& found) {
    const Eigen::Vector3d p = found.error.template head<3>();
    const Eigen::Matrix3d P = found.pose.T_B_N.covariance.template topLeftCorner<3, 3>();
    return found.at > kWarmUp && !(p.dot(P.llt().solve(p)) <= kQuantile);
  }));
}

TEST(ImuFaults, ADamagedSampleCostsNoPoseAndLittleAccuracy) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const EstimatorPair healthy = run_through(seed, nullptr);
    for (const Damage& damage : kDamages) {
      const EstimatorPair damaged = run_through(seed, &damage);

      EXPECT_EQ(damaged.found().size(), healthy.found().size()) << damage.name << ' ' << seed;
      EXPECT_LE(beyond_five_sigma(damaged), beyond_five_sigma(healthy)) << damage.name;
      for (Duration t = kWarmUp; t < damaged.now(); t += 1s) {
        // Poses of one second share their errors: the healthy one may be small by chance.
        constexpr double kBias = 0.01;
        EXPECT_LE(root_mean_square_m(damaged, t, t + 1s),
                  1.5 * root_mean_square_m(healthy, t, t + 1s) + kBias)
            << damage.name << ' ' << seed << ' ' << to_seconds(t);
      }
    }
  }
}

/// A robot lands or hits a wall: the sample looks as if it were damaged, but its speed changes.
TEST(ImuFaults, ABlowCostsNoPoseAndIsWithinItsSigma) {
  int poses = 0;
  int beyond = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    EstimatorPair pair(seed);
    RandomGeometry random(seed);
    pair.run_for(kWarmUp);
    const std::size_t before = pair.found().size();
    for (int i = 0; i < kInstants; ++i) {
      const Eigen::Vector3d v_W = random.uniform(0.2, 0.8) * random.vector(1.0).normalized();
      pair.run_for(10ms * random.index(50));
      pair.hit(i % 2 == 0, v_W);
      pair.run_for(500ms);
      pair.hit(i % 2 == 0, -v_W);
      pair.run_for(500ms);
      EXPECT_NE(pair.latest(), nullptr) << seed << ' ' << i;
    }
    const Duration tested = pair.now() - kWarmUp;
    EXPECT_EQ(pair.found().size() - before, static_cast<std::size_t>(tested / EstimatorPair::kTick))
        << seed;
    poses += static_cast<int>(pair.found().size() - before);
    beyond += beyond_five_sigma(pair);
  }
  EXPECT_LE(beyond, poses / 2000) << "of " << poses;
}

TEST(ImuFaults, ADamagedSampleIsCountedWithItsReason) {
  for (const bool own : {true, false}) {
    EstimatorPair pair(1);
    pair.run_for(kWarmUp);
    pair.run_for(10ms, with_damage(own, [](const ImuSample& sample) {
                   ImuSample read = sample;
                   read.gyro_radps.x() = 34.9;
                   return read;
                 }));
    pair.run_for(200ms);

    const ImuFaultCounts& refused =
        own ? pair.estimator_status().refused_imu : pair.status().refused_imu;
    ImuFaultCounts expected{};
    expected.at(static_cast<std::size_t>(ImuFault::kSpike)) = 1;
    EXPECT_EQ(refused, expected) << own;
    EXPECT_EQ(pair.estimator_status().refused_samples, own ? 1U : 0U);
  }
}

TEST(ImuFaults, AHealthySampleIsNeverRefused) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    EstimatorPair pair(seed);
    pair.run_for(6s);

    EXPECT_EQ(pair.estimator_status().refused_imu, ImuFaultCounts{}) << seed;
    EXPECT_EQ(pair.status().refused_imu, ImuFaultCounts{}) << seed;
  }
}

/// No pose from half a second of the fault on, for the right reason; poses within a second after
/// it, and honest.
void expect_no_pose_while(const Damage& damage, bool own) {
  int poses = 0;
  int dishonest = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    EstimatorPair pair(seed);
    pair.run_for(kWarmUp);
    const Conditions with = with_damage(own, [&damage](const ImuSample& sample) {
      ImuSample read = sample;
      damage.apply(read);
      return read;
    });
    pair.run_for(800ms, with);
    EXPECT_EQ(pair.latest(), nullptr) << damage.name << ' ' << seed;
    EXPECT_EQ(pair.status().reason, own ? NoPoseReason::kNoOwnImu : NoPoseReason::kNoPeerImu)
        << damage.name << ' ' << seed;
    pair.run_for(1s);
    EXPECT_NE(pair.latest(), nullptr) << damage.name << ' ' << seed;
    pair.run_for(1s);
    for (const EstimatorPair::Found& found : pair.found()) {
      if (found.at <= kWarmUp) continue;
      ++poses;
      dishonest += found.nees <= 22.46 ? 0 : 1;  // the 99.9 % quantile
    }
  }
  EXPECT_LE(dishonest, poses / 50) << damage.name << ' ' << own << ", of " << poses;
}

TEST(ImuFaults, AnotherUnitTakesThePoseAwayUntilASecondAfterIt) {
  expect_no_pose_while(kDamages[1], true);
  expect_no_pose_while(kDamages[1], false);
  expect_no_pose_while(kDamages[3], true);
  expect_no_pose_while(kDamages[3], false);
}

TEST(ImuFaults, SwappedAxesTakeThePoseAwayUntilASecondAfterThem) {
  const Damage swapped{"swapped axes", [](ImuSample& s) {
                         std::swap(s.gyro_radps.x(), s.gyro_radps.z());
                         std::swap(s.accel_mps2.x(), s.accel_mps2.z());
                       }};
  expect_no_pose_while(swapped, true);
  expect_no_pose_while(swapped, false);
}

}  // namespace
}  // namespace crepes::imu_faults_test
