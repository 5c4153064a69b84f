#include "daemon/devices/iio_sensor.hpp"

#include <gtest/gtest.h>

#include <variant>

#include "tests/support/fake_iio.hpp"
#include "tests/support/manual_clock.hpp"

namespace crepes::iio_sensor_test {
namespace {

using namespace std::chrono_literals;

class IioSensor : public testing::Test {
 protected:
  void SetUp() override {
    clock_.set(Timestamp{100s});
    settings_.rate_hz = 200.0;
    settings_.device.protocol = ImuProtocol::kIio;
  }
  [[nodiscard]] Sensor sensor() {
    return iio_sensor(
        settings_, clock_,
        [this](const Event& event) { samples_.push_back(std::get<ImuSample>(event)); },
        machine_.paths());
  }
  void send(Timestamp time, std::int64_t z) {
    machine_.send(0, ScanBytes()
                         .triad(0, 0, z << 4U)
                         .triad(1 << 4U, 0, 0)
                         .stamp(time.time_since_epoch().count())
                         .bytes());
  }

  FakeIio machine_;
  ManualClock clock_;
  ImuSensorSettings settings_;
  std::vector<ImuSample> samples_;
};

TEST_F(IioSensor, CorrectsSamplesAndCountsThem) {
  add_one_chip(machine_);
  settings_.device.T_body_imu.q = Eigen::Quaterniond(0, 1, 0, 0);  // upside down
  auto device = sensor().open();
  ASSERT_TRUE(device) << device.error().message;
  send(clock_.now() - 5ms, 20);
  send(clock_.now(), 22);

  const auto count = (*device)->read_once(0ms);

  EXPECT_EQ(count, 2U);
  ASSERT_EQ(samples_.size(), 2U);
  EXPECT_NEAR(samples_[0].accel_mps2.z(), -10.0, 1e-9);
  EXPECT_EQ(samples_[0].stamp, clock_.now() - 5ms);
  EXPECT_EQ((*device)->diagnosis(), std::nullopt);
  const SensorTotals totals = (*device)->counters();
  for (const auto& [name, value] : totals.faults) EXPECT_EQ(value, 0U) << name;
  EXPECT_EQ(totals.counts.front(), (Totals::value_type{"samples", 2}));
}

TEST_F(IioSensor, IsLookedForUntilItIsThere) {
  const Sensor absent = sensor();
  const auto nothing = absent.open();
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::kNotFound);

  add_one_chip(machine_);

  EXPECT_TRUE(absent.open());
}

TEST_F(IioSensor, IsGoneAfterItWasUnpluggedAndCanBeOpenedAgain) {
  add_one_chip(machine_);
  {
    auto device = sensor().open();
    ASSERT_TRUE(device);
    machine_.unplug(0);
    EXPECT_FALSE((*device)->read_once(0ms));
  }
  EXPECT_EQ(machine_.read(0, "buffer/enable"), "0");
}

}  // namespace
}  // namespace crepes::iio_sensor_test
