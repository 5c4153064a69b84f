#include "firmware/led_board/blink.h"

#include <gtest/gtest.h>

#include <random>

#include "estimator/vision/id_library.hpp"
#include "tests/support/led_settings.hpp"

namespace crepes::blink_test {
namespace {

constexpr Duration kTick = std::chrono::microseconds(LED_TICK_US);

/// The first tick of three periods that is not as `code` says; -1 where there is none.
std::int64_t first_difference(const led_settings& settings, const BlinkCode& code) {
  led_blink blink = led_blink_start(&settings);
  const std::int64_t ticks = 3 * code.period() / kTick;
  for (std::int64_t tick = 0; tick < ticks; ++tick)
    if (led_blink_step(&blink) != code.is_lit(tick * kTick)) return tick;
  return -1;
}

std::string random_pattern(std::mt19937& random) {
  std::string pattern(8 + random() % 25U, '0');
  for (char& slot : pattern) slot = random() % 2U == 0 ? '0' : '1';
  pattern.front() = '1';
  pattern.back() = '0';
  return pattern;
}

TEST(Blink, IsTheIdLibrarysCodeTickByTick) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const std::string pattern = random_pattern(random);
    const auto slot_ticks = static_cast<std::uint16_t>(20 + random() % 481U);
    const led_settings settings = pattern_settings(1, pattern, slot_ticks);
    ASSERT_EQ(led_settings_fault(&settings), LED_FINE);

    EXPECT_EQ(first_difference(settings, *BlinkCode::from_pattern(pattern, slot_ticks * kTick)), -1)
        << pattern << " at " << slot_ticks;
  }
}

TEST(Blink, IsTheIdLibrarysDutyCodeTickByTick) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 300; ++trial) {
    const auto period = static_cast<std::uint16_t>(100 + random() % 1901U);
    const auto lit = static_cast<std::uint16_t>(5 + random() % (period - 9U));
    const led_settings settings = duty_settings(1, lit, static_cast<std::uint16_t>(period - lit));
    ASSERT_EQ(led_settings_fault(&settings), LED_FINE);

    const double duty = static_cast<double>(lit) / period;
    EXPECT_EQ(first_difference(settings, *BlinkCode::from_duty(duty, period * kTick)), -1)
        << lit << " of " << period;
  }
}

TEST(Blink, ABoardNeverSetIsDark) {
  const led_settings unset = led_settings_unset();
  led_blink blink = led_blink_start(&unset);
  for (int tick = 0; tick < 100'000; ++tick) ASSERT_FALSE(led_blink_step(&blink));
}

TEST(Blink, TheTestLightEndsByItselfAndLeavesThePhaseAlone) {
  const led_settings settings = pattern_settings(1, "00100101");
  led_blink blink = led_blink_start(&settings);
  led_blink undisturbed = blink;
  blink.test_ticks = 1234;

  for (int tick = 0; tick < 5000; ++tick) {
    const bool lit = led_blink_step(&undisturbed);
    ASSERT_EQ(led_blink_step(&blink), lit || tick < 1234) << tick;
  }
}

}  // namespace
}  // namespace crepes::blink_test
