/// The LED board's real image on QEMU's STM32F100.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/base/unique_fd.hpp"
#include "estimator/core/result.hpp"
#include "tests/support/ram_flash.hpp"

namespace crepes {

/// Why the image cannot run here; empty if it can.
[[nodiscard]] std::string why_no_board();

/// A running board. The destructor stops it.
class QemuBoard {
 public:
  /// `flash` is the content of its settings pages; `options` are for QEMU.
  [[nodiscard]] static Result<QemuBoard> start(RamFlash& flash,
                                               const std::vector<std::string>& options);
  QemuBoard(QemuBoard&& other) noexcept;
  QemuBoard& operator=(QemuBoard&&) = delete;
  QemuBoard(const QemuBoard&) = delete;
  QemuBoard& operator=(const QemuBoard&) = delete;
  ~QemuBoard();

  /// The next line of QEMU's log; empty when it ended, or after some seconds of silence.
  [[nodiscard]] std::optional<std::string> log_line();

  /// The serial line.
  void send(std::span<const std::uint8_t> bytes) const;
  [[nodiscard]] std::optional<std::uint8_t> receive(std::chrono::milliseconds timeout) const;

 private:
  QemuBoard(pid_t pid, std::filesystem::path folder, UniqueFd in, UniqueFd out, UniqueFd log);

  pid_t pid_;
  std::filesystem::path folder_;  ///< what QEMU loads from
  UniqueFd in_;
  UniqueFd out_;
  UniqueFd log_;
  std::string pending_;
  std::size_t read_to_ = 0;
};

}  // namespace crepes
