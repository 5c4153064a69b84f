/// Requests to an LED board and its answers.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "drivers/serial/serial_port.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/result.hpp"
#include "firmware/protocol/led_messages.h"

namespace crepes {

/// A fault in words, for the user who programs a board.
[[nodiscard]] std::string describe(led_fault fault);

/// The serial line of one board.
class LedLine {
 public:
  /// `clock` must outlive this.
  [[nodiscard]] static Result<LedLine> open(const std::string& path, const Clock& clock);

  /// The board's settings; robot_id is 0 if the board was never programmed.
  [[nodiscard]] Result<led_settings> settings();
  [[nodiscard]] Result<led_status> status();
  /// Stores valid settings on the board. An error if they read back differently.
  [[nodiscard]] Result<void> set(const led_settings& settings);
  /// Steady light.
  [[nodiscard]] Result<void> test(std::chrono::milliseconds duration);

 private:
  LedLine(SerialPort port, const Clock& clock) : port_(std::move(port)), clock_(clock) {}

  struct Question {
    led_frame request;
    led_message answer;
    std::size_t answer_size;
  };

  [[nodiscard]] Result<led_frame> ask(const Question& question);
  [[nodiscard]] Result<std::optional<led_frame>> listen(const Question& question,
                                                        led_receiver& receiver);

  SerialPort port_;
  const Clock& clock_;
};

}  // namespace crepes
