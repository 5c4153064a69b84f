/// A serial device, raw.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "drivers/serial/frame_decoder.hpp"
#include "drivers/unique_fd.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// A terminal device in raw mode, 8N1, no flow control, at any rate, kept from other programs.
class SerialPort {
 public:
  /// What was received before is thrown away. Errors name the device and the cause, and who has it
  /// open; kNotFound: there is no such device now.
  [[nodiscard]] static Result<SerialPort> open(const std::string& path, int baud);

  /// The bytes that are there, or that come within `timeout`; empty when none came. Valid until
  /// the next call. An error means that the device is gone: open it anew.
  [[nodiscard]] Result<Bytes> read_some(std::chrono::milliseconds timeout);

  /// Sends all of `bytes`, or says why not; waits at most `timeout` each time the line is full.
  [[nodiscard]] Result<void> write_all(Bytes bytes, std::chrono::milliseconds timeout);

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  SerialPort(UniqueFd fd, std::string path) : fd_(std::move(fd)), path_(std::move(path)) {}

  UniqueFd fd_;
  std::string path_;
  std::array<std::uint8_t, 4096> buffer_{};
};

}  // namespace crepes
