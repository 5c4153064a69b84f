/// The image as it is flashed, on QEMU's STM32F100. That has SysTick, interrupts and USART1; it
/// logs writes to the GPIO port, and its clock and flash interfaces never answer.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>

#include "config/reading/config_file.hpp"
#include "estimator/vision/id_decoder.hpp"
#include "estimator/vision/id_library.hpp"
#include "firmware/led_board/settings_store.h"
#include "tests/firmware/qemu_board.hpp"
#include "tests/support/led_settings.hpp"
#include "tests/support/places.hpp"

namespace crepes::led_image_test {
namespace {

using namespace std::chrono_literals;

const std::string kLightWrite = "GPIOA: unimplemented device write (size 4, offset 0x000, value 0x";
constexpr Duration kTick = std::chrono::microseconds(LED_TICK_US);

#define SKIP_WITHOUT_BOARD() \
  if (const std::string why = why_no_board(); !why.empty()) GTEST_SKIP() << why

RamFlash holding(const led_settings& settings) {
  RamFlash flash;
  const led_flash port = flash.port();
  EXPECT_TRUE(led_settings_save(&port, &settings));
  return flash;
}

SwarmConfig swarm_of_64() {
  const CheckedConfig checked =
      check_config(source_dir() + "/config/libraries/library64.yaml");  // a part of a config
  EXPECT_EQ(checked.config.swarm.members.size(), 64U);
  return checked.config.swarm;
}

/// The light in the log: for each tick, whether the write to the port lit the LEDs.
struct Waveform {
  std::vector<bool> lit;
  std::set<int> traces_per_write;  ///< how many lines on SysTick came between two writes
  std::set<std::string> values;    ///< ever written
  std::string reload;              ///< what SysTick counts down from, in hexadecimal
};

Waveform record(QemuBoard& board, std::size_t ticks) {
  const std::string tick = "systick_timer_tick";
  const std::string reload = "systick_write systick write addr 0x4 data ";
  Waveform waveform;
  int traces = 0;
  while (waveform.lit.size() < ticks) {
    const std::optional<std::string> line = board.log_line();
    if (!line) break;
    if (line->starts_with(tick)) ++traces;
    if (line->starts_with(reload)) waveform.reload = line->substr(reload.size());
    if (!line->starts_with(kLightWrite)) continue;
    const std::string value = line->substr(kLightWrite.size(), 8);
    waveform.values.insert(value);
    if (traces == 0) continue;  // before SysTick ran
    waveform.traces_per_write.insert(traces);
    waveform.lit.push_back(value == "aa88aaaa");
    traces = 0;
  }
  return waveform;
}

Result<QemuBoard> start_on_virtual_time(const led_settings& settings) {
  RamFlash flash = holding(settings);
  return QemuBoard::start(flash, {"-d", "unimp,trace:systick_timer_tick,trace:systick_write",
                                  "-icount", "shift=0,sleep=off"});
}

/// The robot that a camera of 200 Hz identifies; empty if undecided.
std::set<int> named(const std::vector<bool>& lit, const IdDecoder& decoder, Duration first_frame) {
  BlinkEvidence evidence;
  std::set<int> ids;
  for (Duration t = first_frame; t / kTick < static_cast<std::int64_t>(lit.size()); t += 5ms) {
    if (lit[static_cast<std::size_t>(t / kTick)])
      decoder.observe_lit(evidence, Timestamp{1s + t});
    else
      decoder.observe_dark(evidence, Timestamp{1s + t});
    if (const auto id = decoder.id_of(evidence)) ids.insert(id->value);
  }
  return ids;
}

TEST(LedImage, BlinksSoThatTheDecoderNamesTheRobotAmongSixtyFour) {
  SKIP_WITHOUT_BOARD();
  const SwarmConfig swarm = swarm_of_64();
  const IdDecoder decoder(*IdLibrary::from(swarm), VisionConfig{}, 200.0);
  for (const std::size_t index : {2U, 40U}) {
    const MemberConfig& member = swarm.members[index];
    Result<QemuBoard> board =
        start_on_virtual_time(pattern_settings(member.id.value, *member.pattern));
    ASSERT_TRUE(board.has_value()) << board.error().message;

    const Waveform waveform = record(*board, 15'000);

    ASSERT_EQ(waveform.lit.size(), 15'000U);
    EXPECT_EQ(waveform.traces_per_write.size(), 1U) << "one write for every tick";
    EXPECT_EQ(waveform.values, (std::set<std::string>{"22882222", "aa88aaaa"}));
    for (const Duration phase : {Duration{0}, Duration{1'300us}, Duration{4'900us}})
      EXPECT_EQ(named(waveform.lit, decoder, phase), std::set<int>{member.id.value});
  }
}

TEST(LedImage, BlinksTheIdLibrarysCodesTickByTick) {
  SKIP_WITHOUT_BOARD();
  struct Sample {
    led_settings settings;
    BlinkCode code;
  };
  for (const auto& [settings, code] :
       {Sample{pattern_settings(9, "00100110011111110011", 33),
               *BlinkCode::from_pattern("00100110011111110011", 33 * kTick)},
        Sample{duty_settings(7, 123, 377), *BlinkCode::from_duty(0.246, 500 * kTick)}}) {
    Result<QemuBoard> board = start_on_virtual_time(settings);
    ASSERT_TRUE(board.has_value()) << board.error().message;

    const Waveform waveform = record(*board, 4001);

    ASSERT_EQ(waveform.lit.size(), 4001U);
    // On QEMU the board finds its slowest clock alone: 800 cycles of 8 MHz are a tick.
    EXPECT_EQ(waveform.reload, "0x31f size 4");
    EXPECT_FALSE(waveform.lit.front()) << "the first tick works out what the second shows";
    for (std::size_t tick = 1; tick < waveform.lit.size(); ++tick)
      ASSERT_EQ(waveform.lit[tick], code.is_lit(static_cast<std::int64_t>(tick - 1) * kTick))
          << tick;
  }
}

/// Repeats the request until there is a reply: on a loaded machine a gap inside a frame may exceed
/// the silence that ends it.
std::optional<led_frame> answer_to(const QemuBoard& board, const led_frame& request) {
  std::array<std::uint8_t, LED_MAX_FRAME> bytes{};
  const std::size_t size = led_frame_write(&request, bytes.data());
  for (int attempt = 0; attempt < 10; ++attempt) {
    board.send(std::span(bytes).first(size));
    led_receiver receiver{};
    led_frame answer{};
    while (const auto byte = board.receive(1s)) {
      led_receiver_push(&receiver, *byte);
      if (led_receiver_next(&receiver, false, &answer)) return answer;
    }
  }
  return std::nullopt;
}

led_frame request_of(led_message type) {
  led_frame request{};
  request.type = static_cast<std::uint8_t>(type);
  return request;
}

TEST(LedImage, AnswersOnItsSerialLineAndOutlivesDeadClockAndFlash) {
  SKIP_WITHOUT_BOARD();
  const led_settings settings = pattern_settings(3, "00100100111100111111");
  RamFlash flash = holding(settings);
  Result<QemuBoard> board = QemuBoard::start(flash, {});
  ASSERT_TRUE(board.has_value()) << board.error().message;
  const std::array<std::uint8_t, 7> garbage{0xC5, 0x9A, 0x1F, 0x00, 0xC5, 0xC5, 0x9A};
  board->send(garbage);

  const auto status = answer_to(*board, request_of(LED_ASK));
  ASSERT_TRUE(status && status->type == LED_STATUS);
  EXPECT_EQ(led_status_read(status->payload).protocol, LED_PROTOCOL_VERSION);
  EXPECT_EQ(led_status_read(status->payload).clock, LED_CLOCK_RC_NO_PLL);
  EXPECT_TRUE(std::ranges::equal(led_status_read(status->payload).version,
                                 std::array{CREPES_VERSION_NUMBERS}));

  const auto reported = answer_to(*board, request_of(LED_GET));
  ASSERT_TRUE(reported && reported->type == LED_SETTINGS);
  EXPECT_EQ(bytes_of(led_settings_read(reported->payload)), bytes_of(settings));

  led_frame set = request_of(LED_SET);
  set.size = LED_SETTINGS_SIZE;
  const led_settings other = duty_settings(5, 100, 400);
  led_settings_write(&other, set.payload);
  const auto refused = answer_to(*board, set);
  ASSERT_TRUE(refused && refused->type == LED_REFUSED);
  EXPECT_EQ(refused->payload[1], LED_BAD_FLASH);

  const auto still = answer_to(*board, request_of(LED_GET));
  ASSERT_TRUE(still && still->type == LED_SETTINGS);
  EXPECT_EQ(bytes_of(led_settings_read(still->payload)), bytes_of(settings));
}

TEST(LedImage, SetsTheLightWithinTenMicrosecondsOfEveryTickWhateverTheLineCarries) {
  SKIP_WITHOUT_BOARD();
  RamFlash flash = holding(pattern_settings(3, "00100100111100111111"));
  Result<QemuBoard> board =
      QemuBoard::start(flash, {"-singlestep", "-d", "unimp,exec,nochain,trace:systick_timer_tick",
                               "-icount", "shift=0,sleep=off"});
  ASSERT_TRUE(board.has_value()) << board.error().message;
  led_frame test = request_of(LED_TEST);
  test.size = 2;
  std::array<std::uint8_t, LED_MAX_FRAME> bytes{};
  const std::size_t size = led_frame_write(&test, bytes.data());

  bool is_due = false;   // a tick came, its write has not yet
  int instructions = 0;  // since the tick
  int ticks = 0;
  int most = 0;
  int answered = 0;
  while (ticks < 6000) {
    const std::optional<std::string> line = board->log_line();
    ASSERT_TRUE(line.has_value());
    if (line->starts_with("systick_timer_tick")) {
      is_due = true;
      instructions = 0;
    }
    if (line->starts_with("Trace")) ++instructions;
    if (!line->starts_with(kLightWrite) || !is_due) continue;
    most = std::max(most, instructions);
    is_due = false;
    if (++ticks % 30 == 0) board->send(std::span(bytes).first(size));
    while (board->receive(0ms)) ++answered;
  }

  EXPECT_GT(answered, 100) << "bytes of answers, or nothing was in the way";
  // An instruction takes 12 cycles of 24 MHz at most: 10 us are 20 of them.
  EXPECT_LE(most, 20);
  EXPECT_GT(most, 0);
}

}  // namespace
}  // namespace crepes::led_image_test
