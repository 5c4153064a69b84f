#include "daemon/ctl/setup/setup_witmotion.hpp"

#include <gtest/gtest.h>

#include "daemon/stages/worker.hpp"
#include "drivers/imu/witmotion_setup.hpp"
#include "tests/support/hex.hpp"
#include "tests/support/witmotion_sensor.hpp"

namespace crepes::setup_witmotion_test {
namespace {

using namespace std::chrono_literals;

TEST(SetupWitMotion, SpeaksTheSensorsCommands) {
  const auto commands = witmotion_setup(200);

  ASSERT_TRUE(commands);
  ASSERT_EQ(commands->size(), 4U);
  const auto expect = [&](std::size_t i, const char* hex) {
    EXPECT_EQ(std::vector<std::uint8_t>((*commands)[i].begin(), (*commands)[i].end()),
              bytes_of(hex));
  };
  expect(0, "ff aa 69 88 b5");  // unlock
  expect(1, "ff aa 02 06 00");  // acceleration and rate
  expect(2, "ff aa 03 0b 00");  // 200 Hz
  expect(3, "ff aa 00 00 00");  // save
  EXPECT_EQ(witmotion_setup(100)->at(2)[3], 0x09);
  EXPECT_EQ(witmotion_setup(150).error().code, ErrorCode::kUsage);
}

TEST(SetupWitMotion, SetsASensorAndMeasuresThatItObeys) {
  PseudoTerminal line = PseudoTerminal::open().value();
  const Worker sensor("sensor",
                      [&](const std::stop_token& stop) { run_witmotion_at_20_hz(line, stop); });

  const auto reported = set_up_witmotion(
      {.port = line.path(), .baud = 115200, .rate_hz = 20, .pause = 0ms, .listen = 1s});

  ASSERT_TRUE(reported) << reported.error().message;
  EXPECT_NEAR(*reported, 20.0, 5.0);  // the measured rate
}

TEST(SetupWitMotion, ReportsThatNothingAnswers) {
  const PseudoTerminal line = PseudoTerminal::open().value();

  const auto reported = set_up_witmotion(
      {.port = line.path(), .baud = 115200, .rate_hz = 100, .pause = 0ms, .listen = 1ms});

  ASSERT_FALSE(reported);
  EXPECT_NE(reported.error().message.find("no sample"), std::string::npos);
}

}  // namespace
}  // namespace crepes::setup_witmotion_test
