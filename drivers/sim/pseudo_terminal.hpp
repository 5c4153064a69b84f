/// A serial line without a wire.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/unique_fd.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The device's end of a serial line; the other end is a terminal that a SerialPort can open.
/// Destruction hangs up.
class PseudoTerminal {
 public:
  [[nodiscard]] static Result<PseudoTerminal> open();

  /// Path of the other end.
  [[nodiscard]] const std::string& path() const { return path_; }

  /// Never waits: returns how many of the bytes were taken. The rest is lost, as on a wire that
  /// nobody listens to.
  std::size_t write(std::span<const std::uint8_t> bytes);

  /// What was sent from the other end, waiting at most `timeout` for it; empty when nothing was.
  [[nodiscard]] std::vector<std::uint8_t> read(std::chrono::milliseconds timeout);

 private:
  PseudoTerminal(UniqueFd master, std::string path)
      : master_(std::move(master)), path_(std::move(path)) {}

  UniqueFd master_;
  std::string path_;
};

}  // namespace crepes
