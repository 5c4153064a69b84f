/// Notifies systemd: ready, reloading, stopping, a status line, and the watchdog.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/stages/counters.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// The iteration counter of one loop of the daemon.
struct Heartbeat {
  std::string loop;
  const Counter* iterations = nullptr;
};

class Watchdog {
 public:
  /// The counters must outlive this. Without systemd it only compares counters.
  explicit Watchdog(std::vector<Heartbeat> heartbeats);

  static void notify_ready();
  /// `now` is the machine's monotonic time. Call `notify_ready` afterwards.
  static void notify_reloading(Timestamp now);
  static void notify_stopping();
  static void notify_status(const std::string& text);

  /// Feeds systemd's watchdog if every loop has iterated since the last call; otherwise returns the
  /// names of the stuck loops. Call it about once a second: loops iterate ten times as often.
  [[nodiscard]] std::vector<std::string> check();

 private:
  std::vector<Heartbeat> heartbeats_;
  std::vector<std::uint64_t> seen_;
};

}  // namespace crepes
