#include "firmware/led_board/command.h"

#include <gtest/gtest.h>

#include <vector>

#include "firmware/led_board/settings_store.h"
#include "tests/support/led_settings.hpp"
#include "tests/support/ram_flash.hpp"

namespace crepes::command_test {
namespace {

struct Board {
  RamFlash flash;
  led_board board{};
  led_frame answer{};

  Board() {
    board.flash = flash.port();
    board.settings = led_settings_load(&board.flash);
  }
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  led_effect ask(std::uint8_t type, const std::vector<std::uint8_t>& payload) {
    led_frame request{};
    request.type = type;
    request.size = static_cast<std::uint8_t>(payload.size());
    std::copy(payload.begin(), payload.end(), request.payload);
    return led_command(&board, &request, &answer);
  }
  led_effect set(const led_settings& settings) {
    const auto bytes = bytes_of(settings);
    return ask(LED_SET, {bytes.begin(), bytes.end()});
  }
  [[nodiscard]] led_fault fault() const {
    return answer.type == LED_REFUSED ? static_cast<led_fault>(answer.payload[1]) : LED_FINE;
  }
};

TEST(LedCommand, SetsStoresAndReportsSettings) {
  Board board;
  const led_settings settings = pattern_settings(3, "00100100111100111111");

  EXPECT_EQ(board.set(settings), LED_EFFECT_BLINK);
  EXPECT_EQ(board.answer.type, LED_SETTINGS);
  EXPECT_EQ(board.ask(LED_GET, {}), LED_EFFECT_NONE);

  const led_settings reported = led_settings_read(board.answer.payload);
  EXPECT_EQ(bytes_of(reported), bytes_of(settings));
  EXPECT_EQ(bytes_of(led_settings_load(&board.board.flash)), bytes_of(settings));
}

TEST(LedCommand, RefusesBadSettingsWithAReasonAndKeepsTheOld) {
  const led_settings good = pattern_settings(3, "0010010011");
  const auto refused = [&](auto change) {
    Board board;
    EXPECT_EQ(board.set(good), LED_EFFECT_BLINK);
    led_settings bad = good;
    change(bad);
    EXPECT_EQ(board.set(bad), LED_EFFECT_NONE);
    EXPECT_EQ(bytes_of(led_settings_load(&board.board.flash)), bytes_of(good));
    return board.fault();
  };

  EXPECT_EQ(refused([](led_settings& s) { s.robot_id = 0; }), LED_BAD_ID);
  EXPECT_EQ(refused([](led_settings& s) { s.robot_id = 65535; }), LED_BAD_ID);
  EXPECT_EQ(refused([](led_settings& s) { s.slots = 7; }), LED_BAD_PATTERN);
  EXPECT_EQ(refused([](led_settings& s) { s.slots = 33; }), LED_BAD_PATTERN);
  EXPECT_EQ(refused([](led_settings& s) { s.slots = 0; }), LED_BAD_PATTERN);
  EXPECT_EQ(refused([](led_settings& s) { s.slots = 2; }), LED_BAD_PATTERN);
  EXPECT_EQ(refused([](led_settings& s) { s.pattern = 0; }), LED_BAD_PATTERN);
  EXPECT_EQ(refused([](led_settings& s) { s.pattern = 0x3FF; }), LED_BAD_PATTERN);
  EXPECT_EQ(refused([](led_settings& s) { s.pattern |= 1U << 10; }), LED_BAD_PATTERN);
  EXPECT_EQ(refused([](led_settings& s) { s.lit_ticks = 99; }), LED_BAD_TIME);
  EXPECT_EQ(refused([](led_settings& s) { s.lit_ticks = s.dark_ticks = 19; }), LED_BAD_TIME);
  EXPECT_EQ(refused([](led_settings& s) { s.lit_ticks = s.dark_ticks = 701; }), LED_BAD_TIME);
  EXPECT_EQ(refused([](led_settings& s) { s = duty_settings(3, 4, 200); }), LED_BAD_TIME);
  EXPECT_EQ(refused([](led_settings& s) { s = duty_settings(3, 50, 49); }), LED_BAD_TIME);
  EXPECT_EQ(refused([](led_settings& s) { s = duty_settings(3, 1000, 1001); }), LED_BAD_TIME);
  EXPECT_EQ(refused([](led_settings& s) { s.brightness[5] = 101; }), LED_BAD_BRIGHTNESS);
}

TEST(LedCommand, ReportsThatFlashFailed) {
  Board board;
  ASSERT_EQ(board.set(pattern_settings(3, "0010010011")), LED_EFFECT_BLINK);
  board.flash.cut_power_after(5, 1);

  EXPECT_EQ(board.set(pattern_settings(4, "0010010011")), LED_EFFECT_NONE);
  EXPECT_EQ(board.fault(), LED_BAD_FLASH);
  EXPECT_EQ(board.board.settings.robot_id, 3);
}

TEST(LedCommand, LightsUpForATestOfAtMostAMinute) {
  Board board;

  EXPECT_EQ(board.ask(LED_TEST, {0xE8, 0x03}), LED_EFFECT_TEST);
  EXPECT_EQ(board.board.test_ticks, 10'000U);
  EXPECT_EQ(board.ask(LED_TEST, {0x61, 0xEA}), LED_EFFECT_NONE);
  EXPECT_EQ(board.fault(), LED_BAD_TIME);
}

TEST(LedCommand, ReportsVersionClockAndSkippedBytes) {
  Board board;
  board.board.status = {LED_PROTOCOL_VERSION, {1, 2, 3}, LED_CLOCK_RC, 1, 517};

  EXPECT_EQ(board.ask(LED_ASK, {}), LED_EFFECT_NONE);

  ASSERT_EQ(board.answer.type, LED_STATUS);
  const led_status status = led_status_read(board.answer.payload);
  EXPECT_EQ(status.protocol, LED_PROTOCOL_VERSION);
  EXPECT_EQ(status.version[2], 3);
  EXPECT_EQ(status.clock, LED_CLOCK_RC);
  EXPECT_EQ(status.was_watchdog, 1);
  EXPECT_EQ(status.skipped, 517);
}

TEST(LedCommand, RefusesWhatItDoesNotKnowAndPayloadsOfAnotherSize) {
  for (int type = 0; type < 256; ++type)
    for (std::size_t size = 0; size <= LED_MAX_PAYLOAD; ++size) {
      const bool is_known = (type == LED_GET && size == 0) || (type == LED_ASK && size == 0) ||
                            (type == LED_TEST && size == 2) ||
                            (type == LED_SET && size == LED_SETTINGS_SIZE);
      if (is_known) continue;
      Board board;

      EXPECT_EQ(board.ask(static_cast<std::uint8_t>(type), std::vector<std::uint8_t>(size)),
                LED_EFFECT_NONE);
      ASSERT_EQ(board.fault(), LED_BAD_REQUEST);
      ASSERT_EQ(board.answer.payload[0], type);
    }
}

}  // namespace
}  // namespace crepes::command_test
