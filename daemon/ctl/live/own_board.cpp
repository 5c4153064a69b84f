#include "daemon/ctl/live/own_board.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "daemon/ctl/setup/led.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/led_board/led_line.hpp"

namespace crepes {

CheckFinding judge_own_board(const led_settings& board, const SwarmConfig& swarm, RobotId self,
                             const std::string& port) {
  const std::string advice =
      fmt::format("crepesctl led --port {} set --id {} --library swarm.yaml", port, self.value);
  const auto fault = [&](std::string text) {
    return CheckFinding{"board", CheckVerdict::kFault, std::move(text), advice};
  };
  const auto wanted = led_settings_of(swarm, self, {100});
  if (!wanted) return fault("our board: " + wanted.error().message);
  if (board.robot_id == 0) return fault("our board was never set, and stays dark");
  if (board.robot_id != self.value)
    return fault(fmt::format("our board blinks the code of robot {}", board.robot_id));
  if (board.slots != wanted->slots || board.pattern != wanted->pattern)
    return fault("our board blinks another pattern than swarm.members has");
  if (board.lit_ticks != wanted->lit_ticks || board.dark_ticks != wanted->dark_ticks)
    return fault("our board blinks at another pace than swarm.slot_ms or period_ms");
  const auto* const dimmest = std::ranges::min_element(board.brightness);
  if (*dimmest == 0)
    return {"board", CheckVerdict::kDoubt, "an LED of our board is set to be dark", advice};
  return {"board", CheckVerdict::kGood, "our board blinks the pattern of swarm.members", ""};
}

CheckFinding check_own_board(const std::string& port, const SwarmConfig& swarm, RobotId self) {
  const MonotonicClock clock;
  Result<LedLine> line = LedLine::open(port, clock);
  const Result<led_settings> board = line.and_then([](LedLine& open) { return open.settings(); });
  if (board) return judge_own_board(*board, swarm, self, port);
  return {"board", CheckVerdict::kFault, "our board does not answer: " + board.error().message,
          "is it connected, and is this its port? crepesctl devices"};
}

}  // namespace crepes
