/// A serial port in raw mode.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "drivers/base/unique_fd.hpp"
#include "drivers/serial/frame_decoder.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// A terminal device in raw mode: 8N1, no flow control, any rate, exclusive.
class SerialPort {
 public:
  /// Discards bytes received earlier. Errors name the device, the cause and the process that has it
  /// open. kNotFound: the device does not exist now.
  [[nodiscard]] static Result<SerialPort> open(const std::string& path, int baud);

  /// The bytes that are available or arrive within `timeout`; empty if none do. Valid until the
  /// next call. An error means that the device is gone: open it again.
  [[nodiscard]] Result<Bytes> read_some(std::chrono::milliseconds timeout);

  /// Sends all of `bytes`, or returns an error. Waits at most `timeout` each time the line is full.
  [[nodiscard]] Result<void> write_all(Bytes bytes, std::chrono::milliseconds timeout);

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  SerialPort(UniqueFd fd, std::string path) : fd_(std::move(fd)), path_(std::move(path)) {}

  UniqueFd fd_;
  std::string path_;
  std::array<std::uint8_t, 4096> buffer_{};
};

}  // namespace crepes
