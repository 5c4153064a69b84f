#include "daemon/service/logging.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <spdlog/async.h>
#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/systemd_sink.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string_view>

namespace crepes {
namespace {

constexpr std::size_t kQueuedLines = 1024;

spdlog::level::level_enum level_of(LogLevel level) {
  constexpr std::array kLevels{spdlog::level::debug, spdlog::level::info, spdlog::level::warn,
                               spdlog::level::err};
  return kLevels.at(static_cast<std::size_t>(level));
}

/// systemd sets JOURNAL_STREAM to the file that it made our stderr, as "device:inode". Messages
/// belong into the journal only if stderr is still that file, and not a terminal.
bool stderr_is_the_journal() {
  const char* stream = std::getenv("JOURNAL_STREAM");  // NOLINT(concurrency-mt-unsafe): no threads
  struct stat file {};
  return stream != nullptr && ::fstat(STDERR_FILENO, &file) == 0 &&
         fmt::format("{}:{}", file.st_dev, file.st_ino) == stream;
}

/// The color of a level on a terminal.
constexpr std::string_view color_of(spdlog::level::level_enum level) {
  if (level >= spdlog::level::err) return "\033[31m\033[1m";
  if (level == spdlog::level::warn) return "\033[33m\033[1m";
  return level == spdlog::level::info ? "\033[32m" : "\033[36m";
}

/// Standard error. A program that reads it and stalls loses lines, but does not keep the daemon
/// from ending: spdlog's own sinks would wait for it for ever.
class StderrSink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t text;
    formatter_->format(message, text);
    std::string line(text.data(), text.size());
    if (has_color_ && message.color_range_end > message.color_range_start) {
      line.insert(message.color_range_end, "\033[m");
      line.insert(message.color_range_start, color_of(message.level));
    }
    if (lost_ > 0 && write(fmt::format("{} lines are lost: nobody read them\n", lost_))) lost_ = 0;
    if (lost_ > 0 || !write(line)) ++lost_;
  }
  void flush_() override {}

  /// In parts that a pipe which has room for anything takes as a whole.
  bool write(std::string_view text) {
    constexpr int kPatienceMs = 500;
    while (!text.empty()) {
      pollfd out{STDERR_FILENO, POLLOUT, 0};
      is_stalled_ = ::poll(&out, 1, is_stalled_ ? 0 : kPatienceMs) != 1;
      if (is_stalled_) return false;
      const ssize_t count =
          ::write(STDERR_FILENO, text.data(), std::min<std::size_t>(text.size(), PIPE_BUF));
      if (count < 0 && errno != EINTR && errno != EAGAIN) return false;
      text.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    }
    return true;
  }

  bool has_color_ = ::isatty(STDERR_FILENO) == 1;
  bool is_stalled_ = false;
  std::uint64_t lost_ = 0;  ///< lines since the last one that was written
};

spdlog::sink_ptr make_sink() {
  if (stderr_is_the_journal()) return std::make_shared<spdlog::sinks::systemd_sink_mt>("crepesd");
  return std::make_shared<StderrSink>();
}

}  // namespace

LogSession::LogSession(LogLevel least) {
  spdlog::init_thread_pool(kQueuedLines, 1);
  auto logger = std::make_shared<spdlog::async_logger>(
      "crepesd", make_sink(), spdlog::thread_pool(), spdlog::async_overflow_policy::overrun_oldest);
  logger->set_level(level_of(least));
  spdlog::set_default_logger(std::move(logger));
}

LogSession::~LogSession() { spdlog::shutdown(); }

void set_log_level(LogLevel least) {
  if (spdlog::logger* logger = spdlog::default_logger_raw(); logger != nullptr)
    logger->set_level(level_of(least));
}

void log_message(LogLevel level, const std::string& message) {
  if (spdlog::logger* logger = spdlog::default_logger_raw(); logger != nullptr)
    logger->log(level_of(level), message);
}

}  // namespace crepes
