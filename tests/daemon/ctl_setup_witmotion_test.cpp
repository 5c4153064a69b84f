#include <gtest/gtest.h>

#include "daemon/ctl/setup_witmotion.hpp"
#include "daemon/worker.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/imu/witmotion_setup.hpp"
#include "drivers/monotonic_clock.hpp"
#include "drivers/sim/pseudo_terminal.hpp"
#include "tests/support/hex.hpp"

namespace crepes {
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

/// A sensor that sends 20 samples a second once it was unlocked and told to.
void run_sensor_at_20_hz(PseudoTerminal& line, const std::stop_token& stop) {
  const MonotonicClock clock;
  std::vector<std::uint8_t> heard;
  Timestamp next = clock.now();
  while (!stop.stop_requested()) {
    heard = heard + line.read(5ms);
    const bool is_told =
        heard == bytes_of("ff aa 69 88 b5 ff aa 02 06 00 ff aa 03 07 00 ff aa 00 00 00");
    if (!is_told) next = clock.now();
    for (; next < clock.now(); next += 50ms)
      line.write(encode_witmotion({0.1, 0.2, 0.3}, {0.0, 0.0, 9.81}));
  }
}

TEST(SetupWitMotion, SetsASensorAndMeasuresThatItObeys) {
  PseudoTerminal line = PseudoTerminal::open().value();
  const Worker sensor("sensor",
                      [&](const std::stop_token& stop) { run_sensor_at_20_hz(line, stop); });

  const auto told = set_up_witmotion(
      {.port = line.path(), .baud = 115200, .rate_hz = 20, .pause = 0ms, .listen = 1s});

  ASSERT_TRUE(told) << told.error().message;
  EXPECT_NE(told->find("set imu.update_rate to 20.0"), std::string::npos) << *told;
}

TEST(SetupWitMotion, TellsThatNothingAnswers) {
  const PseudoTerminal line = PseudoTerminal::open().value();

  const auto told = set_up_witmotion(
      {.port = line.path(), .baud = 115200, .rate_hz = 100, .pause = 0ms, .listen = 1ms});

  ASSERT_FALSE(told);
  EXPECT_NE(told.error().message.find("no sample"), std::string::npos);
}

}  // namespace
}  // namespace crepes
