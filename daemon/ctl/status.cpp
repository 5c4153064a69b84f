#include "daemon/ctl/status.hpp"

#include <algorithm>
#include <vector>

#include "daemon/ctl/full_status.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

using Rows = std::vector<std::vector<std::string>>;

/// "gated 3, late 1"; empty if there is nothing to tell.
std::string text_of(const StatusMessage::Totals& totals) {
  std::string text;
  for (const auto& [name, total] : totals)
    text += (text.empty() ? "" : ", ") + name + " " + std::to_string(total);
  return text;
}

std::string head_of(const StatusMessage& status) {
  const double share = status.uptime_s > 0 ? 100.0 * status.cpu_s / status.uptime_s : 0.0;
  return "robot " + std::to_string(status.self.value) + " " + status.name + ", up " +
         fixed(status.uptime_s, 0) + " s, " + fixed(share, 1) + " % of a core, " +
         fixed(status.rss_mb, 0) + " MB\n";
}

std::string sensors_of(const StatusMessage& status) {
  Rows rows{{"sensor", "rate Hz", "state", "faults", "counts"}};
  for (const auto& sensor : status.sensors) {
    const std::string what = sensor.message.empty() ? "fault" : sensor.message;
    rows.push_back({sensor.name, sensor.rate_hz > 0 ? fixed(sensor.rate_hz, 1) : "-",
                    sensor.ok ? "ok" : what, text_of(sensor.faults), text_of(sensor.counts)});
  }
  return text_table(rows);
}

std::string neighbors_of(const StatusMessage& status) {
  Rows rows{{"neighbor", "state", "heard ms ago", "lost %", "clock s", "+- ms", "ppm", "why not"}};
  for (const auto& neighbor : status.neighbors) {
    std::vector<std::string> row{
        neighbor.name.empty() ? std::to_string(neighbor.neighbor.value) : neighbor.name,
        neighbor.state};
    const auto& reports = neighbor.reports;
    const double sent = reports ? static_cast<double>(reports->received + reports->lost) : 0.0;
    row.push_back(reports ? fixed(1e3 * reports->age_s, 0) : "-");
    row.push_back(sent > 0 ? fixed(100.0 * static_cast<double>(reports->lost) / sent, 1) : "-");
    const auto clock =
        std::ranges::find(status.clocks, neighbor.neighbor, &StatusMessage::Clock::peer);
    const bool known = clock != status.clocks.end();
    row.push_back(known ? fixed(clock->offset_s, 6) : "-");
    row.push_back(known ? fixed(1e3 * clock->sigma_s, 3) : "-");
    row.push_back(known ? fixed(clock->skew_ppm, 1) : "-");
    row.push_back(neighbor.reason);
    rows.push_back(std::move(row));
  }
  return text_table(rows);
}

/// What was refused, lost or dropped anywhere; a healthy robot has a short line here.
std::string totals_of(const StatusMessage& status) {
  std::string text;
  if (!status.network.empty()) text += "network: " + text_of(status.network) + "\n";
  if (!status.queues.empty()) text += "dropped from queues: " + text_of(status.queues) + "\n";
  return text;
}

}  // namespace

std::string status_text(const StatusMessage& status) {
  return head_of(status) + "\n" + sensors_of(status) + "\n" + neighbors_of(status) + "\n" +
         totals_of(status);
}

Result<std::string> status(const StatusOptions& options) {
  return ask_full_status(options.daemon).map([&](const FullStatus& full) {
    return options.json ? full.json + "\n" : status_text(full.message);
  });
}

}  // namespace crepes
