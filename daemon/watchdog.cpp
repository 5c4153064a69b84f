#include "daemon/watchdog.hpp"

#include <systemd/sd-daemon.h>

#include <chrono>
#include <cstddef>
#include <utility>

namespace crepes {

Watchdog::Watchdog(std::vector<Heartbeat> heartbeats)
    : heartbeats_(std::move(heartbeats)), seen_(heartbeats_.size(), 0) {}

// Failing to reach systemd is no reason to stop: its watchdog then does what it is for.
void Watchdog::tell_ready() { ::sd_notify(0, "READY=1"); }
void Watchdog::tell_reloading(Timestamp now) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(now.time_since_epoch());
  ::sd_notify(0, ("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(us.count())).c_str());
}
void Watchdog::tell_stopping() { ::sd_notify(0, "STOPPING=1"); }
void Watchdog::tell_status(const std::string& text) { ::sd_notify(0, ("STATUS=" + text).c_str()); }

std::vector<std::string> Watchdog::check() {
  std::vector<std::string> stuck;
  for (std::size_t i = 0; i < heartbeats_.size(); ++i) {
    const std::uint64_t turns = heartbeats_[i].turns->value();
    if (turns == seen_[i]) stuck.push_back(heartbeats_[i].loop);
    seen_[i] = turns;
  }
  if (stuck.empty()) ::sd_notify(0, "WATCHDOG=1");
  return stuck;
}

}  // namespace crepes
