#include "daemon/logging.hpp"

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/systemd_sink.h>
#include <spdlog/spdlog.h>

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

spdlog::sink_ptr make_sink() {
  // systemd sets JOURNAL_STREAM for what it starts; read before there are threads.
  const bool under_systemd =
      std::getenv("JOURNAL_STREAM") != nullptr;  // NOLINT(concurrency-mt-unsafe)
  if (under_systemd) return std::make_shared<spdlog::sinks::systemd_sink_mt>("crepesd");
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

void log_message(LogLevel level, const std::string& message) {
  if (spdlog::logger* logger = spdlog::default_logger_raw(); logger != nullptr)
    logger->log(level_of(level), message);
}

}  // namespace crepes
