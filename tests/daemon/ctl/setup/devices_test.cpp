#include "daemon/ctl/setup/devices.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "daemon/stages/worker.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/sleep.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/sim/pseudo_terminal.hpp"
#include "tests/support/fake_iio.hpp"
#include "tests/support/gige_camera.hpp"

namespace crepes::devices_test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

void black(const GigeCamera::Picture& picture) { std::memset(picture.pixels, 0, picture.size()); }

class Devices : public testing::Test {
 protected:
  void SetUp() override {
    if (!enter_own_network()) GTEST_SKIP() << "no right to a network of our own";
    auto scratch = ScratchDirectory::create("");
    ASSERT_TRUE(scratch) << scratch.error().message;
    scratch_.emplace(std::move(*scratch));
    options_.dev = scratch_->path();
    options_.iio = machine_.paths();
    fs::create_directories(options_.dev / "serial/by-id");
  }

  std::optional<ScratchDirectory> scratch_;
  FakeIio machine_;
  DevicesOptions options_;
};

TEST_F(Devices, AreFoundAndListenedTo) {
  const GigeCamera camera(black);
  PseudoTerminal line = PseudoTerminal::open().value();
  const fs::path port = options_.dev / "serial/by-id/usb-imu";
  fs::create_symlink(line.path(), port);
  const Worker sensor("imu", [&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      line.write(encode_witmotion({0.1, 0.2, 0.3}, {0.0, 0.0, 9.81}));
      sleep_for(10ms);
    }
  });

  options_.json = true;
  const auto json = list_devices(options_);

  ASSERT_TRUE(json);
  const auto reported = nlohmann::json::parse(*json);
  EXPECT_EQ(reported["cameras"][0].value("driver", ""), "aravis") << reported;
  EXPECT_EQ(reported["cameras"][0].value("device", ""), GigeCamera::kId);
  EXPECT_EQ(reported["serial_ports"][0].value("speaks", ""), "witmotion") << reported;
  EXPECT_EQ(reported["serial_ports"][0].value("port", ""), port.string());
}

TEST_F(Devices, AreReportedInWordsToo) {
  const GigeCamera camera(black);

  const auto text = list_devices(options_);

  ASSERT_TRUE(text);
  EXPECT_NE(text->find("cameras: [{name: cam0, driver: aravis, device: \"Aravis-Fake-GV01\"}]"),
            std::string::npos)
      << *text;
  EXPECT_NE(text->find("no serial port"), std::string::npos) << *text;
}

TEST_F(Devices, ThatCannotBeListenedToAreNamedToo) {
  options_.json = true;
  fs::create_symlink("/dev/null", options_.dev / "serial/by-id/usb-nothing");

  const auto reported = nlohmann::json::parse(list_devices(options_).value());

  EXPECT_TRUE(reported["cameras"].empty());
  EXPECT_NE(reported["serial_ports"][0].value("fault", ""), "");
}

TEST_F(Devices, OfTheKernelAreFoundToo) {
  add_icm42688(machine_);

  const std::string text = list_devices(options_).value();
  options_.json = true;
  const auto reported = nlohmann::json::parse(list_devices(options_).value());

  EXPECT_NE(text.find("iio:device0 (icm42688-gyro), iio:device1 (icm42688-accel)\n"
                      "    imu: {protocol: iio, port: \"icm42688\"}\n"),
            std::string::npos)
      << text;
  EXPECT_EQ(reported["kernel_imus"][0].value("port", ""), "icm42688") << reported;
  EXPECT_EQ(reported["kernel_imus"][0].value("accelerometer", ""), "icm42688-accel");
}

TEST_F(Devices, MayBeNone) { EXPECT_EQ(list_devices(options_), "no camera\nno serial port\n"); }

}  // namespace
}  // namespace crepes::devices_test
