#include "drivers/serial/device_name.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>

namespace crepes::device_name_test {
namespace {

namespace fs = std::filesystem;

/// A /dev of our own: files are devices, and udev is the test.
class DeviceNameTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string path = fs::temp_directory_path() / "crepes-XXXXXX";
    ASSERT_NE(::mkdtemp(path.data()), nullptr);
    dev_ = path;
    fs::create_directories(by_id());
  }
  void TearDown() override { fs::remove_all(dev_); }

  [[nodiscard]] fs::path by_id() const { return dev_ / "serial/by-id"; }
  [[nodiscard]] std::string tty(int number) const {
    return dev_ / ("ttyUSB" + std::to_string(number));
  }
  [[nodiscard]] std::string link(const std::string& name) const { return by_id() / name; }

  void plug(const std::string& name, int number) {
    std::ofstream{tty(number)};
    fs::remove(link(name));
    fs::create_symlink("../../ttyUSB" + std::to_string(number), link(name));
  }
  void unplug(const std::string& name, int number) {
    fs::remove(link(name));
    fs::remove(tty(number));
  }

  fs::path dev_;
};

TEST_F(DeviceNameTest, FollowsTheDeviceToAnotherTty) {
  plug("usb-LinkTrack", 0);
  DeviceName name(tty(0), by_id());
  EXPECT_EQ(name.path_to_open(), tty(0));
  name.remember_link();

  unplug("usb-LinkTrack", 0);
  plug("usb-IMU", 0);
  EXPECT_EQ(name.path_to_open(), link("usb-LinkTrack"));  // not there, and not the IMU
  plug("usb-LinkTrack", 1);

  EXPECT_EQ(name.path_to_open(), link("usb-LinkTrack"));
  EXPECT_TRUE(fs::equivalent(name.path_to_open(), tty(1)));
}

TEST_F(DeviceNameTest, ForgetsTheDeviceOnlyForAnother) {
  plug("usb-LinkTrack", 0);
  DeviceName name(tty(0), by_id());
  name.remember_link();
  unplug("usb-LinkTrack", 0);
  plug("usb-LinkTrack", 1);

  name.configure(tty(0));
  EXPECT_EQ(name.path_to_open(), link("usb-LinkTrack"));

  name.configure(tty(5));
  EXPECT_EQ(name.path_to_open(), tty(5));
}

TEST_F(DeviceNameTest, KeepsTheConfiguredPathWhereNoLinkPointsAtIt) {
  plug("usb-IMU", 1);
  std::ofstream{tty(0)};
  DeviceName name(tty(0), by_id());
  name.remember_link();

  fs::remove(tty(0));

  EXPECT_EQ(name.path_to_open(), tty(0));
}

TEST_F(DeviceNameTest, KeepsALinkThatIsConfigured) {
  plug("usb-IMU", 0);
  DeviceName name(link("usb-IMU"), by_id());
  name.remember_link();

  unplug("usb-IMU", 0);
  plug("usb-IMU", 7);

  EXPECT_EQ(name.path_to_open(), link("usb-IMU"));
}

TEST_F(DeviceNameTest, GoesByThePathWhereTwoAdaptersShareALink) {
  plug("usb-serial", 0);
  DeviceName name(tty(0), by_id());
  name.remember_link();
  plug("usb-serial", 1);  // takes the link over

  EXPECT_EQ(name.path_to_open(), tty(0));
}

TEST_F(DeviceNameTest, SurvivesADirectoryThatIsNotThere) {
  DeviceName name(tty(0), "/no/such/directory");
  name.remember_link();

  EXPECT_EQ(name.path_to_open(), tty(0));
  EXPECT_EQ(by_id_link_of(tty(0), by_id()), std::nullopt);
}

TEST_F(DeviceNameTest, NamesTheProgramThatHasADeviceOpen) {
  plug("usb-IMU", 0);
  EXPECT_EQ(process_using(tty(0)), std::nullopt);

  const std::ifstream open(link("usb-IMU"));

  ASSERT_TRUE(process_using(tty(0)));
  EXPECT_NE(process_using(tty(0))->find("(" + std::to_string(::getpid()) + ")"), std::string::npos);
}

}  // namespace
}  // namespace crepes::device_name_test
