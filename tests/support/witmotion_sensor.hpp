/// A WitMotion sensor at the other end of a serial line.
#pragma once

#include <chrono>
#include <stop_token>
#include <vector>

#include "drivers/base/monotonic_clock.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/sim/pseudo_terminal.hpp"
#include "tests/support/hex.hpp"

namespace crepes {

/// Sends 20 samples a second once it was unlocked and commanded to.
inline void run_witmotion_at_20_hz(PseudoTerminal& line, const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kPeriod{50};
  const MonotonicClock clock;
  std::vector<std::uint8_t> heard;
  Timestamp next = clock.now();
  while (!stop.stop_requested()) {
    heard = heard + line.read(std::chrono::milliseconds{5});
    const bool is_commanded =
        heard == bytes_of("ff aa 69 88 b5 ff aa 02 06 00 ff aa 03 07 00 ff aa 00 00 00");
    if (!is_commanded) next = clock.now();
    for (; next < clock.now(); next += kPeriod)
      line.write(encode_witmotion({0.1, 0.2, 0.3}, {0.0, 0.0, 9.81}));
  }
}

}  // namespace crepes
