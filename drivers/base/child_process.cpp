#include "drivers/base/child_process.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

#include "drivers/base/io_failure.hpp"

namespace crepes {
namespace {

constexpr int kCannotRun = 127;  // as shells say it

/// Runs between fork and exec: calls only async-signal-safe functions.
[[noreturn]] void become(const char* program, char* const* arguments, int log, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(kCannotRun);
  ::setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
  ::dup2(log, STDOUT_FILENO);
  ::dup2(log, STDERR_FILENO);
  ::execv(program, arguments);
  ::_exit(kCannotRun);
}

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::filesystem::path& program,
                                         const std::vector<std::string>& arguments,
                                         const std::filesystem::path& log) {
  if (::access(program.c_str(), X_OK) != 0) {
    return fail(ErrorCode::kNotFound,
                fmt::format("{}: {}", program.string(), std::generic_category().message(errno)));
  }
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  const int fd = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) return io_failure(log.string());
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) become(argv.front(), argv.data(), fd, parent);
  const int reason = errno;
  ::close(fd);
  if (pid < 0) return io_failure("fork", reason);
  return ChildProcess(pid);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), exit_reason_(std::move(other.exit_reason_)) {}

ChildProcess::~ChildProcess() {
  constexpr int kPatienceMs = 1000;
  constexpr int kStepMs = 10;
  terminate();
  for (int waited = 0; pid_ > 0 && !exit_reason() && waited < kPatienceMs; waited += kStepMs)
    ::poll(nullptr, 0, kStepMs);
  if (pid_ <= 0 || exit_reason()) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

void ChildProcess::terminate() const { send_signal(SIGTERM); }

void ChildProcess::send_signal(int signal) const {
  if (pid_ > 0 && !exit_reason_) ::kill(pid_, signal);
}

const std::optional<std::string>& ChildProcess::exit_reason() {
  int status = 0;
  if (pid_ > 0 && !exit_reason_ && ::waitpid(pid_, &status, WNOHANG) == pid_) {
    exit_reason_ = WIFSIGNALED(status) ? fmt::format("killed by signal {}", WTERMSIG(status))
                                       : fmt::format("exit code {}", WEXITSTATUS(status));
  }
  return exit_reason_;
}

}  // namespace crepes
