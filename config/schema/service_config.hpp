/// Settings of the service: recording, the page, and log messages.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// The socket for `crepesctl record`.
struct RecordingConfig {
  std::string socket = "/run/crepes/record";

  [[nodiscard]] bool operator==(const RecordingConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("socket", socket,
            "Unix socket that serves the measurements; empty: none (a relative path starts at the "
            "daemon's working directory)");
  }
};

/// What the page of `crepesctl view` may do.
struct ViewConfig {
  bool control = false;

  [[nodiscard]] bool operator==(const ViewConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("control", control,
            "whether who opens the page of crepesctl view may set exposure, gain and threshold");
  }
};

/// The importance of a message.
enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning, kError };
inline constexpr std::array kLogLevels{
    Choice{"debug", LogLevel::kDebug}, Choice{"info", LogLevel::kInfo},
    Choice{"warning", LogLevel::kWarning}, Choice{"error", LogLevel::kError}};

/// The messages of the daemon.
struct LogConfig {
  LogLevel level = LogLevel::kInfo;

  [[nodiscard]] bool operator==(const LogConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("level", level, kLogLevels, "lowest severity that is written");
  }
};

}  // namespace crepes
