#include "drivers/iio/iio_imu.hpp"

#include <gtest/gtest.h>

#include "tests/support/fake_iio.hpp"
#include "tests/support/manual_clock.hpp"

namespace crepes::iio_imu_test {
namespace {

using namespace std::chrono_literals;

constexpr Timestamp kNow{100s};

std::int64_t ns_at(Timestamp time) { return time.time_since_epoch().count(); }

class IioImuDevice : public testing::Test {
 protected:
  void SetUp() override { clock_.set(kNow); }

  Result<IioImu> open(const std::string& port = "", double rate_hz = 200.0) {
    return IioImu::open(machine_.paths(), port, rate_hz, clock_);
  }
  IioImu opened(const std::string& port = "", double rate_hz = 200.0) {
    auto imu = open(port, rate_hz);
    EXPECT_TRUE(imu) << imu.error().message;
    return std::move(imu.value());
  }
  std::string fault(const std::string& port = "", double rate_hz = 200.0) {
    const auto imu = open(port, rate_hz);
    return imu ? "" : imu.error().message;
  }
  void read(IioImu& imu, int times = 1) {
    for (int i = 0; i < times; ++i) {
      const auto result =
          imu.read_once(0ms, [&](const ImuSample& sample) { samples_.push_back(sample); });
      ASSERT_TRUE(result) << result.error().message;
    }
  }
  static std::vector<std::uint8_t> scan(Timestamp time, std::int64_t x, std::int64_t y,
                                        std::int64_t z) {
    return ScanBytes(std::endian::big).triad(x, y, z).stamp(ns_at(time)).bytes();
  }

  FakeIio machine_;
  ManualClock clock_;
  std::vector<ImuSample> samples_;
};

TEST_F(IioImuDevice, JoinsGyroscopeAndAccelerometerOfTwoDevices) {
  add_icm42688(machine_);
  machine_.write(1, "in_accel_mount_matrix", "0, -1, 0; 1, 0, 0; 0, 0, 1");
  IioImu imu = opened();

  machine_.send(1, scan(kNow - 10ms, 0, 0, 900));
  machine_.send(1, scan(kNow, 0, 100, 1100));
  machine_.send(0, scan(kNow - 5ms, -100, 200, 0x7fff));
  read(imu);

  ASSERT_EQ(samples_.size(), 1U);
  EXPECT_EQ(samples_[0].stamp, kNow - 5ms);
  EXPECT_LT((samples_[0].gyro_radps - Eigen::Vector3d(-0.1, 0.2, 32.767)).norm(), 1e-9);
  EXPECT_LT((samples_[0].accel_mps2 - Eigen::Vector3d(-0.5, 0.0, 10.0)).norm(), 1e-9);
  EXPECT_EQ(imu.diagnosis(), std::nullopt);
}

TEST_F(IioImuDevice, SetsUpOnlyWhatItReadsAndStopsAtTheEnd) {
  add_icm42688(machine_);
  machine_.write(0, "scan_elements/in_temp_en", "1");
  {
    const IioImu imu = opened();
    for (const int n : {0, 1}) {
      EXPECT_EQ(machine_.read(n, "buffer/enable"), "1");
      EXPECT_EQ(machine_.read(n, "buffer/length"), "256");
      EXPECT_EQ(machine_.read(n, "current_timestamp_clock"), "monotonic");
      EXPECT_EQ(machine_.read(n, "scan_elements/in_temp_en"), "0");
      EXPECT_EQ(machine_.read(n, "scan_elements/in_timestamp_en"), "1");
    }
    EXPECT_EQ(machine_.read(0, "scan_elements/in_anglvel_z_en"), "1");
    EXPECT_EQ(machine_.read(1, "scan_elements/in_accel_x_en"), "1");
    EXPECT_EQ(machine_.read(0, "in_anglvel_sampling_frequency"), "200");
    EXPECT_EQ(machine_.read(1, "in_accel_sampling_frequency"), "200");
    EXPECT_EQ(imu.diagnosis(), std::nullopt);
  }
  EXPECT_EQ(machine_.read(0, "buffer/enable"), "0");
  EXPECT_EQ(machine_.read(1, "buffer/enable"), "0");
}

TEST_F(IioImuDevice, ReadsAChipThatIsOneDeviceInPieces) {
  add_one_chip(machine_);
  IioImu imu = opened();
  const auto one = ScanBytes()
                       .triad(40 << 4U, 0, -(20 << 4))
                       .triad(-(4 << 4), 8 << 4U, 12 << 4U)
                       .stamp(ns_at(kNow - 5ms))
                       .bytes();
  const auto two = ScanBytes().triad(16, 16, 16).triad(0, 0, 0).stamp(ns_at(kNow)).bytes();
  const auto bytes = [&] {
    auto both = one;
    both.insert(both.end(), two.begin(), two.end());
    return both;
  }();

  for (const std::uint8_t byte : bytes) {
    machine_.send(0, {byte});
    read(imu);
  }

  ASSERT_EQ(samples_.size(), 2U);
  EXPECT_EQ(samples_[0].stamp, kNow - 5ms);
  EXPECT_EQ(samples_[0].accel_mps2, Eigen::Vector3d(20.0, 0.0, -10.0));
  EXPECT_EQ(samples_[0].gyro_radps, Eigen::Vector3d(-1.0, 2.0, 3.0));
  EXPECT_EQ(samples_[1].stamp, kNow);
}

/// BMI088: the kernel's driver of the accelerometer has no buffer, that of the gyroscope a trigger.
void add_bmi088(FakeIio& machine) {
  machine.write(0, "name", "bmi088-accel");
  machine.add_quantity(0, "accel", "0.01");
  machine.write(0, "in_accel_sampling_frequency", "12.5");
  machine.write(0, "in_accel_sampling_frequency_available", "12.5 25 50 100 200 400 800 1600");
  machine.write(1, "name", "bmi088_gyro");
  machine.add_quantity(1, "anglvel", "0.001");
  machine.add_to_buffer(1, "anglvel", 0, "le:s16/16>>0");
  machine.add_buffer(1, 3);
  machine.write(1, "trigger/current_trigger", "");
  FakeIio::write(machine.paths().devices / "trigger0" / "name", "bmi088_gyro-any-motion-dev1");
  FakeIio::write(machine.paths().devices / "trigger1" / "name", "bmi088_gyro-dev1");
}

TEST_F(IioImuDevice, ReadsAnAccelerometerWithoutBufferWheneverRatesArrive) {
  add_bmi088(machine_);
  IioImu imu = opened("bmi088");
  EXPECT_EQ(machine_.read(1, "trigger/current_trigger"), "bmi088_gyro-dev1");
  EXPECT_EQ(machine_.read(0, "in_accel_sampling_frequency"), "200");
  machine_.write(0, "in_accel_z_raw", "981");

  for (int i = 0; i < 4; ++i) {
    clock_.set(kNow + i * 5ms);
    machine_.send(1, ScanBytes().triad(100, 0, 0).stamp(ns_at(clock_.now() - 1ms)).bytes());
    read(imu);
  }

  ASSERT_EQ(samples_.size(), 3U);  // there was no acceleration before the first
  EXPECT_LT((samples_[0].accel_mps2 - Eigen::Vector3d(0, 0, 9.81)).norm(), 1e-9);
  EXPECT_EQ(samples_[0].stamp, kNow + 4ms);
  EXPECT_EQ(imu.counts().unpaired, 0U);
}

TEST_F(IioImuDevice, KeepsATriggerThatIsChosenAndAsksForOneThatIsNot) {
  add_bmi088(machine_);
  machine_.write(1, "trigger/current_trigger", "my-timer");
  EXPECT_EQ(fault(), "");
  EXPECT_EQ(machine_.read(1, "trigger/current_trigger"), "my-timer");

  machine_.write(1, "trigger/current_trigger", "");
  std::filesystem::remove_all(machine_.paths().devices / "trigger1");
  EXPECT_NE(fault().find("no trigger, and none named bmi088_gyro-dev1"), std::string::npos)
      << fault();
}

TEST_F(IioImuDevice, NamesWhatIsMissing) {
  const auto empty = open();
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().code, ErrorCode::kNotFound);
  EXPECT_NE(empty.error().message.find("no gyroscope"), std::string::npos);

  add_icm42688(machine_);
  EXPECT_NE(fault("bmi088").find("imu.port names (bmi088)"), std::string::npos) << fault("bmi088");
  EXPECT_NE(fault("icm42688-gyro").find("no accelerometer"), std::string::npos);

  machine_.remove(1, "scan_elements/in_accel_y_en");
  EXPECT_NE(fault().find("iio:device1 (icm42688-accel): no channel in_accel_y"), std::string::npos)
      << fault();
  EXPECT_EQ(machine_.read(0, "buffer/enable"), "0");

  machine_.remove(1, "in_accel_scale");
  machine_.write(1, "scan_elements/in_accel_y_en", "0");
  EXPECT_NE(fault().find("in_accel_scale"), std::string::npos) << fault();
}

TEST_F(IioImuDevice, RefusesAnUnknownTypeOfScanElement) {
  add_icm42688(machine_);
  machine_.write(0, "scan_elements/in_anglvel_x_type", "le:f32/32>>0");

  EXPECT_NE(fault().find("in_anglvel_x: unknown type of scan element \"le:f32/32>>0\""),
            std::string::npos)
      << fault();
}

TEST_F(IioImuDevice, SaysThatTheRateIsWrong) {
  add_icm42688(machine_);
  machine_.write(0, "in_anglvel_sampling_frequency_available", "833");

  EXPECT_EQ(
      opened().diagnosis(),
      "iio:device0 (icm42688-gyro): it samples at 833 Hz, imu.update_rate is 200; set either");
}

TEST_F(IioImuDevice, LeavesARateThatCannotBeSetAndSaysWhatItIs) {
  add_icm42688(machine_);
  const auto file = machine_.folder(0) / "in_anglvel_sampling_frequency";
  std::filesystem::remove(file);
  std::filesystem::create_directory(file);  // cannot be written, even by root

  EXPECT_NE(fault().find("in_anglvel_sampling_frequency"), std::string::npos);
}

TEST_F(IioImuDevice, ThatIsUnpluggedIsAnError) {
  add_icm42688(machine_);
  for (const int n : {0, 1}) {
    IioImu imu = opened();
    machine_.unplug(n);

    const auto result = imu.read_once(0ms, [](const ImuSample&) {});

    ASSERT_FALSE(result) << n;
    EXPECT_NE(result.error().message.find("unplugged"), std::string::npos);
    std::filesystem::remove_all(machine_.paths().dev / ("iio:device" + std::to_string(n)));
    machine_.add_buffer(n, 4);
  }
}

TEST_F(IioImuDevice, RefusesStampsOfAnotherClockAndOfThePast) {
  add_icm42688(machine_);
  IioImu imu = opened();
  machine_.send(1, scan(kNow - 10ms, 0, 0, 981));
  machine_.send(1, scan(kNow, 0, 0, 981));
  const auto good = scan(kNow - 5ms, 1, 2, 3);
  machine_.send(0, good);
  machine_.send(0, good);  // twice
  read(imu);
  EXPECT_EQ(samples_.size(), 1U);
  EXPECT_EQ(imu.counts().stamps_refused, 1U);
  EXPECT_EQ(imu.diagnosis(), std::nullopt);

  machine_.send(0, scan(kNow + 1000h, 1, 2, 3));
  read(imu);

  EXPECT_EQ(samples_.size(), 1U);
  EXPECT_EQ(imu.counts().stamps_refused, 2U);
  const std::string fault = imu.diagnosis().value_or("");
  EXPECT_NE(fault.find("1 s before or 0.02 s after"), std::string::npos) << fault;

  machine_.send(0, scan(kNow - 1000h, 1, 2, 3));
  read(imu);

  EXPECT_EQ(imu.diagnosis(), fault) << "each change would be logged";
}

/// A kernel that only has the wall clock: its stamps are mapped as those of a device's clock.
TEST_F(IioImuDevice, MapsStampsOfAClockThatIsNotOurs) {
  add_one_chip(machine_);
  machine_.remove(0, "current_timestamp_clock");
  std::filesystem::create_directory(machine_.folder(0) / "current_timestamp_clock");
  IioImu imu = opened();

  for (int i = 0; i < 400; ++i) {
    const Timestamp measured = kNow + i * 5ms;
    clock_.set(measured + i % 4 * 1ms);
    machine_.send(0, ScanBytes()
                         .triad(0, 0, 20 << 4U)
                         .triad(16, 0, 0)
                         .stamp(1'700'000'000'000'000'000 + ns_at(measured))
                         .bytes());
    read(imu);
  }

  ASSERT_EQ(samples_.size(), 400U);
  EXPECT_EQ(imu.counts().stamps_refused, 0U);
  EXPECT_GT(samples_[50].stamp, kNow + 250ms);  // an arrival, as long as the clock is unknown
  EXPECT_NEAR(to_seconds(samples_.back().stamp - (kNow + 399 * 5ms)), 0.0, 200e-6);
}

TEST_F(IioImuDevice, ChoosesAmongSeveral) {
  add_icm42688(machine_);
  machine_.write(2, "name", "adxl345");
  machine_.add_quantity(2, "accel", "0.01");
  machine_.write(3, "name", "ads1015");
  EXPECT_EQ(fault(), "");

  machine_.write(4, "name", "bmi088_gyro");
  machine_.add_quantity(4, "anglvel", "0.01");
  EXPECT_NE(fault().find("several gyroscopes: iio:device0 (icm42688-gyro), iio:device4"),
            std::string::npos)
      << fault();
  EXPECT_EQ(fault("icm42688"), "");
  EXPECT_EQ(fault("/dev/iio:device0, iio:device2"), "");
  EXPECT_NE(fault("bmi088 adxl345").find("has no buffer"), std::string::npos);
}

TEST_F(IioImuDevice, IsListedWithWhatNamesIt) {
  EXPECT_TRUE(find_iio_imus(machine_.paths()).empty());
  add_icm42688(machine_);
  machine_.write(2, "name", "adxl345");
  machine_.add_quantity(2, "accel", "0.01");
  const auto one = find_iio_imus(machine_.paths());
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].port, "icm42688");
  EXPECT_EQ(one[0].devices.accelerometer.name, "icm42688-accel");

  for (const int n : {3, 4}) {
    machine_.write(n, "name", "mpu6500");
    machine_.add_quantity(n, "accel", "0.01");
    machine_.add_quantity(n, "anglvel", "0.01");
  }
  const auto three = find_iio_imus(machine_.paths());
  ASSERT_EQ(three.size(), 3U);
  EXPECT_EQ(three[1].port, "iio:device3");
  EXPECT_EQ(three[2].port, "iio:device4");
}

TEST(ChipOf, LeavesOutTheKind) {
  EXPECT_EQ(chip_of("icm42688-gyro"), "icm42688");
  EXPECT_EQ(chip_of("lsm6dso_accel"), "lsm6dso");
  EXPECT_EQ(chip_of("mpu6500"), "mpu6500");
  EXPECT_EQ(chip_of("iim-42652"), "iim-42652");
}

}  // namespace
}  // namespace crepes::iio_imu_test
