#include "daemon/service/watchdog.hpp"

#include <fmt/core.h>
#include <systemd/sd-daemon.h>

#include <chrono>
#include <cstddef>
#include <utility>

namespace crepes {

Watchdog::Watchdog(std::vector<Heartbeat> heartbeats)
    : heartbeats_(std::move(heartbeats)), seen_(heartbeats_.size(), 0) {}

// If systemd cannot be reached, the daemon goes on; systemd's watchdog then restarts it.
void Watchdog::notify_ready() { ::sd_notify(0, "READY=1"); }
void Watchdog::notify_reloading(Timestamp now) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(now.time_since_epoch());
  ::sd_notify(0, fmt::format("RELOADING=1\nMONOTONIC_USEC={}", us.count()).c_str());
}
void Watchdog::notify_stopping() { ::sd_notify(0, "STOPPING=1"); }
void Watchdog::notify_status(const std::string& text) {
  ::sd_notify(0, ("STATUS=" + text).c_str());
}

std::vector<std::string> Watchdog::check() {
  std::vector<std::string> stuck;
  for (std::size_t i = 0; i < heartbeats_.size(); ++i) {
    const std::uint64_t iterations = heartbeats_[i].iterations->value();
    if (iterations == seen_[i]) stuck.push_back(heartbeats_[i].loop);
    seen_[i] = iterations;
  }
  if (stuck.empty()) ::sd_notify(0, "WATCHDOG=1");
  return stuck;
}

}  // namespace crepes
