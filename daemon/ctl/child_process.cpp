#include "daemon/ctl/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

namespace crepes {
namespace {

constexpr int kCannotRun = 127;  // as shells say it

/// Between fork and exec: calls only what is safe there.
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
                program.string() + ": " + std::generic_category().message(errno));
  }
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  const int fd = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0)
    return fail(ErrorCode::kIo, log.string() + ": " + std::generic_category().message(errno));
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) become(argv.front(), argv.data(), fd, parent);
  const int reason = errno;
  ::close(fd);
  if (pid < 0)
    return fail(ErrorCode::kIo, std::string("fork: ") + std::generic_category().message(reason));
  return ChildProcess(pid);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), ending_(std::move(other.ending_)) {}

ChildProcess::~ChildProcess() {
  constexpr int kPatienceMs = 1000;
  constexpr int kStepMs = 10;
  ask_to_stop();
  for (int waited = 0; pid_ > 0 && !ending() && waited < kPatienceMs; waited += kStepMs)
    ::poll(nullptr, 0, kStepMs);
  if (pid_ <= 0 || ending()) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

void ChildProcess::ask_to_stop() const { send_signal(SIGTERM); }

void ChildProcess::send_signal(int signal) const {
  if (pid_ > 0 && !ending_) ::kill(pid_, signal);
}

const std::optional<std::string>& ChildProcess::ending() {
  int status = 0;
  if (pid_ > 0 && !ending_ && ::waitpid(pid_, &status, WNOHANG) == pid_) {
    ending_ = WIFSIGNALED(status) ? "killed by signal " + std::to_string(WTERMSIG(status))
                                  : "exit code " + std::to_string(WEXITSTATUS(status));
  }
  return ending_;
}

}  // namespace crepes
