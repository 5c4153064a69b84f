#include "daemon/devices/serial_sensors.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <variant>

#include "daemon/service/logging.hpp"
#include "daemon/stages/sensor_stage.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/sim/pseudo_terminal.hpp"
#include "tests/support/manual_clock.hpp"
#include "tests/support/recorded_files.hpp"

namespace crepes::serial_sensors_test {
namespace {

using namespace std::chrono_literals;

/// A serial line whose other end is the test's.
class SerialSensors : public testing::Test {
 protected:
  void SetUp() override {
    auto line = PseudoTerminal::open();
    ASSERT_TRUE(line) << line.error().message;
    line_ = std::make_unique<PseudoTerminal>(std::move(*line));
    config_.imu.device.port = line_->path();
    config_.uwb.device.port = line_->path();
    config_.swarm.members.resize(1);
    config_.swarm.members[0].id = RobotId{1};
  }

  std::unique_ptr<Device> open(const Sensor& sensor) {
    auto device = sensor.open();
    EXPECT_TRUE(device) << device.error().message;
    return device ? std::move(*device) : nullptr;
  }
  std::unique_ptr<Device> open_imu() {
    return open(imu_sensor(
        imu_sensor_settings(config_), clock_,
        [this](Event event) {
          if (const auto* sample = std::get_if<ImuSample>(&event)) samples_.push_back(*sample);
        },
        name_));
  }
  std::unique_ptr<Device> open_uwb() {
    return open(uwb_sensor(
        uwb_sensor_settings(config_), clock_, [](Event) {}, name_));
  }

  /// The device sends these bytes again and again, ten times a second.
  void send_for(Device& device, const std::vector<std::uint8_t>& bytes, Duration duration) {
    for (Duration sent{}; sent < duration; sent += 100ms) {
      ASSERT_EQ(line_->write(bytes), bytes.size());
      clock_.set(clock_.now() + 100ms);
      ASSERT_TRUE(device.read_once(1s));
    }
  }

  ManualClock clock_;
  DeviceName name_{"", kSerialById};
  std::unique_ptr<PseudoTerminal> line_;
  Config config_;
  std::vector<ImuSample> samples_;
};

TEST_F(SerialSensors, RecognizeWhichInertialSensorTalks) {
  for (const char* name :
       {"imu/witmotion_hwt905_real", "imu/hipnuc_hi91_official", "imu/xsens_mtdata2_accgyr",
        "imu/mavlink_highres_imu_v2", "imu/witmotion_ble_built"}) {
    SCOPED_TRACE(name);
    samples_.clear();
    const auto device = open_imu();

    send_for(*device, recorded_file(name).bytes, 800ms);

    EXPECT_GE(samples_.size(), 3U);
    EXPECT_EQ(device->diagnosis(), std::nullopt);
  }
}

TEST_F(SerialSensors, RecognizeWhichRangingModuleTalks) {
  const std::string line = "range 1 4.27\n";
  const auto device = open_uwb();

  send_for(*device, {line.begin(), line.end()}, 1600ms);

  EXPECT_EQ(device->diagnosis(), std::nullopt);
  const Totals counts = device->counters().counts;
  EXPECT_EQ(counts.front().first, "ranges");
  EXPECT_GE(counts.front().second, 10U);
}

TEST_F(SerialSensors, AskADwm1001ForDistancesWhileItIsSilent) {
  config_.uwb.device.protocol = UwbProtocol::kDwm1001Shell;
  const auto device = open_uwb();
  for (int i = 0; i < 3; ++i) {
    clock_.set(clock_.now() + 1s);
    ASSERT_TRUE(device->read_once(1ms));
  }

  const std::string expected = "\r\rlec\r\r\r";
  std::string asked;  // each request may arrive by itself
  while (asked.size() < expected.size()) {
    const auto bytes = line_->read(1s);
    if (bytes.empty()) break;
    asked.append(bytes.begin(), bytes.end());
  }

  EXPECT_EQ(asked, expected);
}

TEST_F(SerialSensors, ReadTheConfiguredProtocolFromTheFirstFrameOn) {
  config_.imu.device.protocol = ImuProtocol::kXsens;
  const auto device = open_imu();

  send_for(*device, recorded_file("imu/xsens_mtdata2_accgyr").bytes, 100ms);

  ASSERT_EQ(samples_.size(), 1U);
  EXPECT_NEAR(samples_[0].accel_mps2.z(), 9.795761, 1e-6);
}

TEST_F(SerialSensors, TurnAndCorrectSamplesAsConfigured) {
  config_.imu.device.protocol = ImuProtocol::kXsens;
  config_.imu.device.accelerometer.bias = {0.0, 0.0, -0.2};
  config_.imu.device.T_body_imu.q = Eigen::Quaterniond(0, 1, 0, 0);  // upside down
  const auto device = open_imu();

  send_for(*device, recorded_file("imu/xsens_mtdata2_accgyr").bytes, 100ms);

  ASSERT_EQ(samples_.size(), 1U);
  EXPECT_NEAR(samples_[0].accel_mps2.z(), -9.995761, 1e-6);
  EXPECT_NEAR(samples_[0].gyro_radps.y(), -0.004283, 1e-6);
}

TEST_F(SerialSensors, SayWhatIsWrongWithinTwoSeconds) {
  const auto fault_of = [&](Device& device, const std::vector<std::uint8_t>& bytes) {
    send_for(device, bytes, 1600ms);
    return device.diagnosis().value_or("");
  };
  const auto says = [](const std::string& fault, const char* what) {
    return fault.find(what) != std::string::npos;
  };
  const auto imu = recorded_file("imu/hipnuc_hi91_official").bytes;
  const auto uwb = recorded_file("nlink/nodeframe3_01").bytes;
  const std::vector<std::uint8_t> noise(40, 0xe0);

  EXPECT_TRUE(says(fault_of(*open_imu(), noise), "wrong baud rate"));
  EXPECT_TRUE(says(fault_of(*open_imu(), uwb), "speaks LinkTrack"));
  EXPECT_TRUE(says(fault_of(*open_uwb(), noise), "wrong baud rate"));
  EXPECT_TRUE(says(fault_of(*open_uwb(), imu), "speaks hipnuc"));
  EXPECT_TRUE(says(fault_of(*open_uwb(), bytes_of("ff 02 10")), "ff 02"));
  const auto with_ff_02 =
      bytes_of("55 51 fe ff 02 00 00 08 b6 09 6c") + bytes_of("55 52 fe ff 02 00 00 00 b6 09 65");
  EXPECT_TRUE(says(fault_of(*open_uwb(), with_ff_02), "speaks witmotion"));
  config_.uwb.device.protocol = UwbProtocol::kLinkTrack;
  EXPECT_TRUE(says(fault_of(*open_uwb(), with_ff_02), "speaks witmotion"));
  EXPECT_TRUE(says(fault_of(*open_uwb(), recorded_file("nlink/nodeframe0_01").bytes),
                   "NodeFrame0, which has no ranges"));
  EXPECT_TRUE(
      says(fault_of(*open_imu(), recorded_file("imu/mavlink_raw_imu_v2").bytes), "RAW_IMU only"));
  config_.imu.device.protocol = ImuProtocol::kMavlink;
  EXPECT_TRUE(says(fault_of(*open_imu(), imu), "speaks hipnuc"));
}

TEST_F(SerialSensors, FindTheSameDeviceAgainUnderAnotherTty) {
  const auto scratch = ScratchDirectory::create("");
  ASSERT_TRUE(scratch);
  const auto link = scratch->path() / "usb-HiPNUC";
  std::filesystem::create_symlink(line_->path(), link);
  config_.imu.device.protocol = ImuProtocol::kHipnuc;
  DeviceName name("", scratch->path());
  const auto make = [&] {
    return imu_sensor(
        imu_sensor_settings(config_), clock_,
        [this](Event event) { samples_.push_back(std::get<ImuSample>(event)); }, name);
  };
  const Sensor sensor = make();
  auto device = open(sensor);
  line_.reset();
  EXPECT_FALSE(device->read_once(1s));
  device.reset();
  std::filesystem::remove(link);
  EXPECT_EQ(sensor.open().error().code, ErrorCode::kNotFound);

  // Two terminals under other numbers than the first; one of these may receive its number.
  std::vector<PseudoTerminal> others;
  while (others.size() < 2 || others.back().path() == config_.imu.device.port)
    others.push_back(std::move(*PseudoTerminal::open()));
  line_ = std::make_unique<PseudoTerminal>(std::move(others.back()));
  others.pop_back();
  const PseudoTerminal* other = &others.back();
  std::filesystem::create_symlink(other->path(), scratch->path() / "usb-other");
  std::filesystem::create_symlink(line_->path(), link);
  device = open(sensor);
  send_for(*device, recorded_file("imu/hipnuc_hi91_official").bytes, 100ms);
  EXPECT_EQ(samples_.size(), 1U);

  device.reset();
  config_.imu.noise.update_rate = 123.0;  // a reload
  device = open(make());
  send_for(*device, recorded_file("imu/hipnuc_hi91_official").bytes, 100ms);
  EXPECT_EQ(samples_.size(), 2U);
}

TEST_F(SerialSensors, TellASensorThatRepeatsItself) {
  config_.imu.device.protocol = ImuProtocol::kHipnuc;
  config_.imu.noise.update_rate = 10.0;
  const auto device = open_imu();

  send_for(*device, recorded_file("imu/hipnuc_hi91_official").bytes, 1s);

  EXPECT_NE(device->diagnosis().value_or("").find("repeats"), std::string::npos);
  const Totals faults = device->counters().faults;
  EXPECT_NE(std::find(faults.begin(), faults.end(), Totals::value_type{"stuck", 5}), faults.end());
}

/// Delivers nothing, or has a fault; each read lasts its full timeout.
class FakeDevice final : public Device {
 public:
  FakeDevice(ManualClock& clock, std::string fault) : clock_(clock), fault_(std::move(fault)) {}
  [[nodiscard]] Result<std::size_t> read_once(std::chrono::milliseconds timeout) override {
    clock_.set(clock_.now() + timeout);
    return 0;
  }
  [[nodiscard]] SensorTotals counters() const override { return {}; }
  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    if (clock_.now() < Timestamp{1s} || fault_.empty()) return std::nullopt;
    return fault_;
  }

 private:
  ManualClock& clock_;
  std::string fault_;
};

/// The time and the text of the first fault that the stage reports for such a device.
std::pair<Timestamp, std::string> first_fault(const std::string& fault) {
  const LogSession log(LogLevel::kError);
  ManualClock clock;
  std::stop_source stop;
  Counter iterations;
  std::string message;
  const Sensor sensor{.name = "imu",
                      .open = [&]() -> Result<std::unique_ptr<Device>> {
                        return std::make_unique<FakeDevice>(clock, fault);
                      },
                      .silence_hint = "silent"};
  const StatusSink report = [&](const SensorStatus& status) {
    message = status.message;
    if (!status.ok || clock.now() > Timestamp{10s}) stop.request_stop();
  };
  run_sensor(fixed_sensor(sensor), {.clock = clock, .report = report, .iterations = iterations},
             stop.get_token());
  return {clock.now(), message};
}

TEST(SensorStage, ReportsAFaultAsSoonAsItLooks) {
  const auto [when, message] = first_fault("wrong device");

  EXPECT_EQ(message, "wrong device");
  EXPECT_LE(when, Timestamp{1300ms});
}

TEST(SensorStage, LooksOftenForADeviceThatIsNotThere) {
  const LogSession log(LogLevel::kError);
  const MonotonicClock clock;
  const Timestamp begin = clock.now();
  std::stop_source stop;
  Counter iterations;
  int looks = 0;
  const Sensor sensor{.name = "imu",
                      .open = [&]() -> Result<std::unique_ptr<Device>> {
                        if (++looks == 8) stop.request_stop();
                        return fail(ErrorCode::kNotFound, "unplugged");
                      },
                      .silence_hint = ""};

  run_sensor(fixed_sensor(sensor),
             {.clock = clock, .report = [](SensorStatus) {}, .iterations = iterations},
             stop.get_token());

  EXPECT_EQ(looks, 8);
  EXPECT_LT(clock.now() - begin, 6s);  // with waits that double it were 11 s
}

TEST(SensorStage, ReportsASilentDeviceWithinTwoSeconds) {
  const auto [when, message] = first_fault("");

  EXPECT_EQ(message, "silent");
  EXPECT_LE(when, Timestamp{2s});
}

}  // namespace
}  // namespace crepes::serial_sensors_test
