/// Tells systemd how we are: ready, in a few words, and alive only if every loop is.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/counters.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// The turns of one loop of the daemon.
struct Heartbeat {
  std::string loop;
  const Counter* turns = nullptr;
};

class Watchdog {
 public:
  /// The counters must outlive this. Does nothing but compare when not started by systemd.
  explicit Watchdog(std::vector<Heartbeat> heartbeats);

  static void tell_ready();
  /// `now` is the machine's monotonic time. To be followed by `tell_ready`.
  static void tell_reloading(Timestamp now);
  static void tell_stopping();
  static void tell_status(const std::string& text);

  /// Feeds systemd's watchdog if every loop turned since the last call; else names those that did
  /// not. To be called about once a second: loops turn ten times as often.
  [[nodiscard]] std::vector<std::string> check();

 private:
  std::vector<Heartbeat> heartbeats_;
  std::vector<std::uint64_t> seen_;
};

}  // namespace crepes
