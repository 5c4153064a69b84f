/// A child process that is always stopped again.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "estimator/core/result.hpp"

namespace crepes {

/// It runs in its own process group, with its output in a file. The destructor ends it; the kernel
/// ends it if this program dies first.
class ChildProcess {
 public:
  /// `arguments` without the program's own name.
  [[nodiscard]] static Result<ChildProcess> start(const std::filesystem::path& program,
                                                  const std::vector<std::string>& arguments,
                                                  const std::filesystem::path& log);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// SIGTERM; SIGKILL if it still runs a second later.
  ~ChildProcess();

  /// How it ended, as "exit code 1" or "killed by signal 11"; empty while it runs.
  [[nodiscard]] const std::optional<std::string>& exit_reason();

  [[nodiscard]] pid_t pid() const { return pid_; }

  /// Sends SIGTERM without waiting.
  void terminate() const;
  void send_signal(int signal) const;

 private:
  explicit ChildProcess(pid_t pid) : pid_(pid) {}

  pid_t pid_;
  std::optional<std::string> exit_reason_;
};

}  // namespace crepes
