#include <gtest/gtest.h>

#include <chrono>
#include <span>
#include <thread>

#include "daemon/ctl/setup/led.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/led_board/led_line.hpp"
#include "drivers/sim/pseudo_terminal.hpp"
#include "estimator/vision/id_library.hpp"
#include "firmware/led_board/blink.h"
#include "firmware/led_board/command.h"
#include "firmware/led_board/settings_store.h"
#include "tests/support/led_settings.hpp"
#include "tests/support/places.hpp"
#include "tests/support/ram_flash.hpp"

namespace crepes::led_command_test {
namespace {

using namespace std::chrono_literals;

const std::filesystem::path kLibrary = source_dir() + "/config/libraries/library64.yaml";

/// The firmware's own code at the other end of a serial line.
class HostBoard {
 public:
  struct Faults {
    bool is_flash_dead = false;
    int answers_torn = 0;  ///< so many of its first answers lose their last byte
  };

  explicit HostBoard(Faults faults) : faults_(faults) {
    if (faults.is_flash_dead) flash_.cut_power_after(0, 1);
    board_.flash = flash_.port();
    board_.settings = led_settings_load(&board_.flash);
    board_.status = {LED_PROTOCOL_VERSION, {1, 2, 3}, LED_CLOCK_CRYSTAL, 0, 0};
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) serve();
    });
  }
  HostBoard() : HostBoard(Faults{}) {}

  [[nodiscard]] std::string port() const { return line_.path(); }
  /// Ends it; what its flash then holds.
  led_settings stop() {
    thread_ = {};
    return led_settings_load(&board_.flash);
  }

 private:
  void serve() {
    for (const std::uint8_t byte : line_.read(10ms)) {
      led_receiver_push(&receiver_, byte);
      led_frame request{};
      while (led_receiver_next(&receiver_, false, &request)) answer(request);
    }
  }
  void answer(const led_frame& request) {
    led_frame frame{};
    led_command(&board_, &request, &frame);
    std::array<std::uint8_t, LED_MAX_FRAME> bytes{};
    std::size_t size = led_frame_write(&frame, bytes.data());
    if (faults_.answers_torn-- > 0) --size;
    line_.write(std::span(bytes).first(size));
  }

  Faults faults_;
  PseudoTerminal line_ = *PseudoTerminal::open();
  RamFlash flash_;
  led_board board_{};
  led_receiver receiver_{};
  std::jthread thread_;
};

std::string error_of(const Result<std::string>& result) {
  return result ? "" : result.error().message;
}

MemberConfig member(const std::string& pattern) {
  MemberConfig member;
  member.id = RobotId{3};
  member.pattern = pattern;
  return member;
}

TEST(LedCommandLine, ProgramsABoardThatThenBlinksAsTheLibrarySays) {
  HostBoard board;

  const Result<std::string> reported = led_set(
      {.port = board.port(), .id = 3, .library = kLibrary, .brightness = {80, 70, 60, 50, 40, 30}});

  ASSERT_TRUE(reported.has_value()) << reported.error().message;
  EXPECT_NE(reported->find("id 3: pattern 00100100111100111111, slots of 10.0 ms\n"
                           "brightness 80 70 60 50 40 30 %\n"
                           "firmware 1.2.3, clock: crystal, 0 bytes skipped\n"),
            std::string::npos)
      << *reported;
  EXPECT_EQ(led_get({.port = board.port()}).value_or(""), *reported);
  EXPECT_EQ(led_get({.port = board.port(), .json = true}).value_or(""),
            R"({"id":3,"pattern":"00100100111100111111","slot_ms":10.0,)"
            R"("brightness":[80,70,60,50,40,30],"firmware":"1.2.3","clock":"crystal",)"
            R"("skipped_bytes":0,"restarted_by_watchdog":false})"
            "\n");
  EXPECT_EQ(led_test({.port = board.port(), .test_s = 0.5, .json = true}).value_or(""),
            "{\"lit_s\":0.5}\n");
  const led_settings kept = board.stop();
  const BlinkCode code = *BlinkCode::from_pattern("00100100111100111111", 10ms);
  led_blink blink = led_blink_start(&kept);
  for (int tick = 0; tick < 4000; ++tick)
    ASSERT_EQ(led_blink_step(&blink), code.is_lit(tick * Duration{100us})) << tick;
}

TEST(LedCommandLine, AsksAgainWhenAnAnswerIsTorn) {
  HostBoard board({.answers_torn = 2});

  const Result<std::string> reported =
      led_set({.port = board.port(), .id = 64, .library = kLibrary});

  EXPECT_EQ(error_of(reported), "");
  EXPECT_EQ(board.stop().robot_id, 64);
}

TEST(LedCommandLine, ReportsWhyTheBoardRefuses) {
  HostBoard board({.is_flash_dead = true});

  const Result<std::string> reported =
      led_set({.port = board.port(), .id = 3, .library = kLibrary});

  EXPECT_EQ(error_of(reported), board.port() + ": refused: " + describe(LED_BAD_FLASH));
  EXPECT_NE(led_get({.port = board.port()}).value_or("").find("never set"), std::string::npos);
  const std::string json = led_get({.port = board.port(), .json = true}).value_or("");
  EXPECT_TRUE(json.starts_with(R"({"firmware":"1.2.3")")) << json;
}

TEST(LedCommandLine, DistinguishesSilenceFromAnotherDevice) {
  PseudoTerminal silent = *PseudoTerminal::open();
  PseudoTerminal other = *PseudoTerminal::open();
  const std::jthread chatter([&](const std::stop_token& stop) {
    const std::array<std::uint8_t, 3> bytes{0x55, 0x51, 0x01};
    while (!stop.stop_requested()) {
      other.write(bytes);
      (void)other.read(20ms);
    }
  });

  EXPECT_EQ(error_of(led_get({.port = silent.path()})),
            silent.path() + ": no answer; is this the LED board?");
  EXPECT_EQ(error_of(led_get({.port = other.path()})),
            other.path() + ": speaks, but not as an LED board does");
  EXPECT_NE(error_of(led_get({.port = "/dev/not_there"})), "");
}

TEST(LedCommandLine, SpeaksOfTheLibrarysFaults) {
  EXPECT_NE(error_of(led_set({.port = "none", .id = 65, .library = kLibrary}))
                .find("library64.yaml: swarm.members: none has id 65"),
            std::string::npos);
  EXPECT_NE(error_of(led_set({.port = "none", .id = 1, .library = "/not/there.yaml"}))
                .find("/not/there.yaml"),
            std::string::npos);
}

TEST(LedSettings, KeepPatternsExactlyAndDutiesToHalfATick) {
  SwarmConfig swarm;
  swarm.slot_ms = 3.3;
  swarm.members = {member("0010010011110011111100000000001")};
  const led_settings pattern = *led_settings_of(swarm, RobotId{3}, {100});
  swarm.members[0].pattern.reset();
  swarm.members[0].duty = 1.0 / 3.0;

  const led_settings duty = *led_settings_of(swarm, RobotId{3}, {100});

  EXPECT_EQ(bytes_of(pattern),
            bytes_of(pattern_settings(3, "0010010011110011111100000000001", 33)));
  EXPECT_EQ(bytes_of(duty), bytes_of(duty_settings(3, 167, 333)));
}

TEST(LedSettings, RefuseWhatABoardCannotDo) {
  SwarmConfig swarm;
  swarm.members = {member("0010010011")};
  swarm.slot_ms = 3.33;
  EXPECT_FALSE(led_settings_of(swarm, RobotId{3}, {100}).has_value());
  swarm.slot_ms = 10.0;
  EXPECT_TRUE(led_settings_of(swarm, RobotId{3}, {100}).has_value());
  EXPECT_FALSE(led_settings_of(swarm, RobotId{4}, {100}).has_value());
  EXPECT_FALSE(led_settings_of(swarm, RobotId{3}, {101}).has_value());
  EXPECT_FALSE(led_settings_of(swarm, RobotId{3}, {1, 2, 3}).has_value());
  swarm.members[0].pattern = "1111111111";
  EXPECT_FALSE(led_settings_of(swarm, RobotId{3}, {100}).has_value());
}

}  // namespace
}  // namespace crepes::led_command_test
