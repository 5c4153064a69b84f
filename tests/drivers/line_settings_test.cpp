#include "drivers/serial/line_settings.hpp"

#include <asm/termbits.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>

#include <array>
#include <cstdlib>

#include "drivers/base/unique_fd.hpp"

namespace crepes::line_settings_test {
namespace {

class LineSettings : public testing::Test {
 protected:
  void SetUp() override {
    std::array<char, 128> path{};
    ASSERT_EQ(::grantpt(master_.get()), 0);
    ASSERT_EQ(::unlockpt(master_.get()), 0);
    ASSERT_EQ(::ptsname_r(master_.get(), path.data(), path.size()), 0);
    line_ = UniqueFd(::open(path.data(), O_RDWR | O_NOCTTY));
    ASSERT_TRUE(line_);
  }
  termios2 settings() {
    termios2 settings{};
    EXPECT_EQ(::ioctl(line_.get(), TCGETS2, &settings), 0);
    return settings;
  }

  UniqueFd master_{::posix_openpt(O_RDWR | O_NOCTTY)};
  UniqueFd line_;
};

TEST_F(LineSettings, TakeRatesThatTheKernelHasNoNameFor) {
  for (const int baud : {1200, 115200, 250000, 921600, 1234567, 3000000, 4000000}) {
    ASSERT_TRUE(set_raw_line(line_.get(), baud, "line")) << baud;
    EXPECT_EQ(settings().c_ospeed, static_cast<speed_t>(baud));
    EXPECT_EQ(settings().c_ispeed, static_cast<speed_t>(baud));
  }
}

TEST_F(LineSettings, AreRawEightBitsWithoutParityOrFlowControl) {
  ASSERT_TRUE(set_raw_line(line_.get(), 115200, "line"));

  const termios2 set = settings();
  EXPECT_EQ(set.c_iflag, 0U);
  EXPECT_EQ(set.c_oflag, 0U);
  EXPECT_EQ(set.c_lflag, 0U);
  EXPECT_EQ(set.c_cflag & (CSIZE | CSTOPB | PARENB | CRTSCTS | CREAD | CLOCAL),
            static_cast<tcflag_t>(CS8 | CREAD | CLOCAL));
}

TEST_F(LineSettings, SayThatADeviceIsNoSerialLine) {
  const UniqueFd null{::open("/dev/null", O_RDWR)};

  EXPECT_EQ(set_raw_line(null.get(), 115200, "null").error().message,
            "null: Inappropriate ioctl for device");
}

}  // namespace
}  // namespace crepes::line_settings_test
