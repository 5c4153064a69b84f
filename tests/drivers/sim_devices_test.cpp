#include <gtest/gtest.h>

#include <vector>

#include "drivers/imu/witmotion.hpp"
#include "drivers/serial/serial_reader.hpp"
#include "drivers/sim/sim_imu.hpp"
#include "drivers/sim/sim_serial.hpp"
#include "drivers/sim/sim_uwb.hpp"
#include "drivers/uwb/nlink.hpp"
#include "estimator/core/constants.hpp"
#include "tests/support/manual_clock.hpp"

namespace crepes::sim_devices_test {
namespace {

using namespace std::chrono_literals;

SwarmConfig swarm_of(int count) {
  SwarmConfig swarm;
  for (int i = 1; i <= count; ++i) {
    MemberConfig member;
    member.id = RobotId{static_cast<std::uint16_t>(i)};
    member.p_body_uwb = {-0.04, 0.02, 0.1};
    swarm.members.push_back(member);
  }
  return swarm;
}

SimConfig config_of(SimScenario scenario) {
  SimConfig config;
  config.scenario = scenario;
  return config;
}

std::vector<UwbRange> ranges_of(const SimUwb& uwb, const SwarmConfig& swarm, double t_s) {
  NlinkParser parser(uwb_modules_of(swarm), 200.0);
  std::vector<UwbRange> ranges;
  parser.parse(uwb.sample(t_s), {}, [&](const UwbRange& range) { ranges.push_back(range); });
  return ranges;
}

class SimUwbTest : public testing::Test {
 protected:
  explicit SimUwbTest(SimScenario scenario, int count)
      : world_(config_of(scenario)), swarm_(swarm_of(count)) {}

  [[nodiscard]] double distance(RobotId a, RobotId b, double t_s) const {
    const Eigen::Vector3d antenna = swarm_.members[0].p_body_uwb;
    return (world_.T_W_B(a, t_s) * antenna - world_.T_W_B(b, t_s) * antenna).norm();
  }

  SimWorld world_;
  SwarmConfig swarm_;
  RangeNoise config_;
};

struct SimUwbFour : SimUwbTest {
  SimUwbFour() : SimUwbTest(SimScenario::kFour, 4) {}
};
struct SimUwbOccluded : SimUwbTest {
  SimUwbOccluded() : SimUwbTest(SimScenario::kOccluded, 5) {}
};

TEST_F(SimUwbFour, BothModulesOfAPairShareItsBias) {
  config_.noise_m = 0.001;
  const auto a = SimUwb::make(world_, RobotId{1}, swarm_, config_);
  const auto b = SimUwb::make(world_, RobotId{3}, swarm_, config_);
  ASSERT_TRUE(a && b);
  int biased = 0;
  int apart = 0;
  for (double t = 0.0; t < 10.0; t += 0.02) {
    const UwbRange to_b = ranges_of(*a, swarm_, t)[1];
    const UwbRange to_a = ranges_of(*b, swarm_, t)[0];
    ASSERT_EQ(to_b.neighbor, RobotId{3});
    ASSERT_EQ(to_a.neighbor, RobotId{1});
    if (std::abs(to_a.range_m - distance(RobotId{1}, RobotId{3}, t)) > 0.005) ++biased;
    if (std::abs(to_a.range_m - to_b.range_m) > 0.008) ++apart;
  }
  EXPECT_GT(biased, 250);
  EXPECT_LT(apart, 25);  // outliers: half a percent of each module's ranges
}

TEST_F(SimUwbFour, RefusesWhatItCannotSimulate) {
  EXPECT_FALSE(SimUwb::make(world_, RobotId{9}, swarm_, config_));
  auto bad = swarm_;
  bad.members[1].uwb_id = 256;
  EXPECT_FALSE(SimUwb::make(world_, RobotId{1}, bad, config_));
  EXPECT_FALSE(SimUwb::make(world_, RobotId{1}, swarm_of(5), config_));
}

TEST_F(SimUwbOccluded, RangesThroughThePillarAreLongOnAWeakFirstPath) {
  const auto uwb = SimUwb::make(world_, RobotId{1}, swarm_, config_);
  ASSERT_TRUE(uwb);
  int through = 0;
  for (double t = 0.0; t < 60.0; t += 0.1) {
    for (const UwbRange& range : ranges_of(*uwb, swarm_, t)) {
      const Eigen::Vector3d antenna = swarm_.members[0].p_body_uwb;
      const bool hidden = world_.is_occluded(world_.T_W_B(RobotId{1}, t) * antenna,
                                             world_.T_W_B(range.neighbor, t) * antenna);
      EXPECT_EQ(range.received_dbm - range.first_path_dbm > config_.late_path_db, hidden);
      if (hidden) ++through;
    }
  }
  EXPECT_GT(through, 50);
}

struct ImuErrors {
  Eigen::Vector3d gyro_mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mean = Eigen::Vector3d::Zero();
  double gyro_variance = 0.0;  ///< of the noise, an axis
};

/// What 2000 samples of one robot's IMU are off.
ImuErrors imu_errors(const SimWorld& world, RobotId robot, const ImuNoise& config) {
  constexpr int kSamples = 2000;
  SimImu imu(world, robot, config);
  WitMotionParser parser;
  ImuErrors errors;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const double t = i * 0.01;
    const auto bytes = imu.sample(t);
    const auto take = [&](const ImuSample& sample) {
      const BodyState body = world.state(robot, t - 0.5 / config.update_rate);
      const Eigen::Vector3d error = sample.gyro_radps - body.w_W_B_B;
      errors.gyro_mean += error / kSamples;
      errors.accel_mean += (sample.accel_mps2 - body.specific_force()) / kSamples;
      errors.gyro_variance += (error - last).squaredNorm() / (6.0 * kSamples);
      last = error;
    };
    parser.parse(bytes, {}, take);
  }
  EXPECT_EQ(parser.counts().samples, static_cast<std::uint64_t>(kSamples));
  return errors;
}

TEST(SimImu, ReadsWhatTheBodyFeelsWithinItsErrors) {
  const ImuNoise config;
  const RobotId on_wheels{2};

  const ImuErrors errors = imu_errors(SimWorld(config_of(SimScenario::kFour)), on_wheels, config);

  EXPECT_GT(errors.gyro_mean.norm(), 1e-4);
  EXPECT_LT(errors.gyro_mean.cwiseAbs().maxCoeff(), 4.0 * config.gyroscope_bias_sigma);
  EXPECT_LT(errors.accel_mean.cwiseAbs().maxCoeff(),
            4.0 * (config.accelerometer_bias_sigma + 9.81 * config.accelerometer_scale_sigma));
  // White noise of density s at rate f, quantized in steps of 2000/32768 deg/s.
  const double step = radians(2000.0) / 32768.0;
  const double expected =
      std::pow(config.gyroscope_noise_density, 2) * config.update_rate + step * step / 12.0;
  EXPECT_NEAR(errors.gyro_variance / expected, 1.0, 0.1);
}

TEST(SimImu, ShakesWithTheRotors) {
  const ImuNoise config;
  const SimWorld world(config_of(SimScenario::kFour));

  const ImuErrors flying = imu_errors(world, RobotId{1}, config);
  const ImuErrors driving = imu_errors(world, RobotId{2}, config);

  EXPECT_GT(flying.gyro_variance, 2.0 * driving.gyro_variance);
}

TEST(SimSerial, FeedsTheRealReaderOnASteadyBeatAndMissesWhatIsLate) {
  const SimWorld world(config_of(SimScenario::kTwo));
  ImuNoise config;
  SimImu imu(world, RobotId{1}, config);
  auto line = SimSerial::open([&](double t_s) { return imu.sample(t_s); }, 100.0);
  ASSERT_TRUE(line) << line.error().message;
  ManualClock clock;
  auto port = SerialPort::open(line->path(), 115200);
  ASSERT_TRUE(port) << port.error().message;
  std::vector<ImuSample> samples;
  SerialReader<WitMotionParser> reader(std::move(*port), WitMotionParser(), clock,
                                       [&](const ImuSample& sample) { samples.push_back(sample); });

  const auto run_until = [&](Duration now) {
    clock.set(Timestamp{now});
    line->run_until(to_seconds(now));
    ASSERT_TRUE(reader.read_once(0ms));
  };
  for (const Duration now : {1000ms, 1004ms, 1010ms, 1011ms, 1052ms}) run_until(now);

  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[1].stamp, Timestamp{1010ms});
  EXPECT_EQ(samples[2].stamp, Timestamp{1052ms});
  EXPECT_EQ(line->missed(), 3U);
  EXPECT_DOUBLE_EQ(line->next_due_s(), 1.06);
  EXPECT_EQ(line->lost_bytes(), 0U);
}

TEST(SimSerial, LosesBytesThatNobodyReadsAndNeverWaits) {
  auto line = SimSerial::open([](double) { return std::vector<std::uint8_t>(1000, 0x55); }, 100.0);
  ASSERT_TRUE(line);

  for (int i = 0; i < 200; ++i) line->run_until(i * 0.01);

  EXPECT_GT(line->lost_bytes(), 100'000U);
}

}  // namespace
}  // namespace crepes::sim_devices_test
