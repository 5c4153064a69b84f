/// crepesctl record: writes the measurements of a running daemon as a data set for replay.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "config/schema/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// What has been recorded until now.
struct RecordProgress {
  double seconds = 0.0;     ///< from the first measurement to the newest
  std::uint64_t bytes = 0;  ///< on disk
  std::uint64_t rows = 0;   ///< of all sensors
  std::uint64_t pictures = 0;
  std::uint64_t missing = 0;  ///< events that came faster than they could be written
  int configurations = 0;     ///< more than one: the daemon was reloaded meanwhile
};

/// Options of `crepesctl record`.
struct RecordOptions {
  static constexpr std::uint64_t kDefaultMaxBytes = std::uint64_t{1} << 30;

  std::filesystem::path dir;
  std::filesystem::path socket = "/run/crepes/record";
  bool pictures = false;
  std::optional<double> duration_s;
  std::uint64_t max_bytes = kDefaultMaxBytes;
  std::function<void(const RecordProgress&)> on_progress{};
  /// What is written, as it arrives: the daemon's configuration at the beginning and after each
  /// reload; rows of `imu0`, `uwb0`, `cam0`, ... as `append_rows` makes them. Optional.
  std::function<void(const Config&)> on_config{};
  std::function<void(const std::string& sensor, std::string_view rows)> on_rows{};
  /// Asked some times a second; ends the recording. Optional.
  std::function<bool()> is_enough{};
};

/// What was recorded, and why it ended.
struct RecordSummary {
  RecordProgress progress;
  std::filesystem::path folder;  ///< the robot's
  std::string end_reason;        ///< why it ended
  std::string warning{};         ///< what the data set lacks; empty if nothing
};

/// Records until a signal, `duration_s`, `max_bytes`, `is_enough`, or the end of the daemon. `dir`
/// must not contain a data set. It is one from the first measurement on; whatever ends the program
/// or the machine costs the last second at most. If the disk is full, the error says what there is.
[[nodiscard]] Result<RecordSummary> record(const RecordOptions& options);

}  // namespace crepes
