/// A simulated serial line.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/base/unique_fd.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The device's end of a serial line; the other end is a terminal that a SerialPort can open. The
/// destructor hangs up.
class PseudoTerminal {
 public:
  [[nodiscard]] static Result<PseudoTerminal> open();

  /// Path of the other end.
  [[nodiscard]] const std::string& path() const { return path_; }

  /// Never blocks. Returns the number of bytes that were written. The rest is lost, as on a line
  /// without a receiver.
  std::size_t write(std::span<const std::uint8_t> bytes);

  /// The bytes sent from the other end; waits at most `timeout`; empty if there are none.
  [[nodiscard]] std::vector<std::uint8_t> read(std::chrono::milliseconds timeout);

 private:
  PseudoTerminal(UniqueFd master, std::string path)
      : master_(std::move(master)), path_(std::move(path)) {}

  UniqueFd master_;
  std::string path_;
};

}  // namespace crepes
