#include "daemon/service/logging.hpp"

#include <fmt/core.h>
#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/systemd_sink.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <memory>

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

spdlog::sink_ptr make_sink() {
  if (stderr_is_the_journal()) return std::make_shared<spdlog::sinks::systemd_sink_mt>("crepesd");
  return std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
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
