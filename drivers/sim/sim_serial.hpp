/// Simulated devices on serial lines.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sim/pseudo_terminal.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Sends the output of a device at a steady rate through a pseudo-terminal. A sample is measured
/// when it is sent. Samples whose time has passed are missed, not sent late.
class SimSerial {
 public:
  /// The output of the device at a world time [s].
  using Device = std::function<std::vector<std::uint8_t>(double)>;

  [[nodiscard]] static Result<SimSerial> open(Device device, double rate_hz);

  /// The path for SerialPort.
  [[nodiscard]] const std::string& path() const { return line_.path(); }
  /// World time of the next sample [s]; in the past before the first call of `run_until`.
  [[nodiscard]] double next_due_s() const { return static_cast<double>(next_) / rate_hz_; }
  /// Sends the sample that is due at world time `now_s`, if any.
  void run_until(double now_s);

  [[nodiscard]] std::uint64_t missed() const { return missed_; }
  [[nodiscard]] std::uint64_t lost_bytes() const { return lost_bytes_; }

 private:
  SimSerial(PseudoTerminal line, Device device, double rate_hz)
      : line_(std::move(line)), device_(std::move(device)), rate_hz_(rate_hz) {}

  PseudoTerminal line_;
  Device device_;
  double rate_hz_;
  std::int64_t next_ = INT64_MIN;  ///< counts samples since the world's epoch
  std::uint64_t missed_ = 0;
  std::uint64_t lost_bytes_ = 0;
};

}  // namespace crepes
