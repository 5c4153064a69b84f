#include "daemon/service/systemd_status.hpp"

#include <fmt/core.h>

#include <cstddef>
#include <string_view>
#include <vector>

#include "net/subscription/fault_text.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

constexpr std::size_t kMaxPart = 200;  // bytes

/// The first line only, so that the status stays one line.
std::string brief(std::string_view text) {
  return truncated_utf8(text.substr(0, text.find('\n')), kMaxPart);
}

void append(std::string& line, std::string_view separator, std::string_view part) {
  if (!line.empty()) line += separator;
  line += part;
}

std::string neighbors_line(const std::vector<NeighborStatus>& neighbors) {
  std::size_t located = 0;
  std::string others;
  for (const NeighborStatus& neighbor : neighbors) {
    if (neighbor.pose) {
      ++located;
    } else {
      append(others, ", ", fmt::format("{}: {}", neighbor.name, name_of(neighbor.reason)));
    }
  }
  std::string line = fmt::format("{} of {} {} located", located, neighbors.size(),
                                 neighbors.size() == 1 ? "neighbor" : "neighbors");
  if (!others.empty()) line += fmt::format(" ({})", brief(others));
  return line;
}

}  // namespace

std::string systemd_status(const SystemStatus& status) {
  std::string line = neighbors_line(status.estimator.neighbors);
  std::string team;
  for (const TeamFault& fault : status.estimator.faults)
    append(team, "; ", fmt::format("this robot: {}", text_of(fault)));
  for (const NeighborStatus& neighbor : status.estimator.neighbors) {
    for (const TeamFault& fault : neighbor.faults)
      append(team, "; ", fmt::format("{}: {}", neighbor.name, text_of(fault)));
  }
  if (!team.empty()) append(line, "; ", brief(team));
  std::string faults;
  for (const SensorStatus& sensor : status.sensors) {
    if (!sensor.ok) append(faults, "; ", fmt::format("{}: {}", sensor.name, sensor.message));
  }
  if (!faults.empty()) append(line, "; ", brief(faults));
  std::string waiting;
  for (const std::string& key : status.config.restart) append(waiting, ", ", key);
  if (!waiting.empty()) line += fmt::format("; restart to apply: {}", brief(waiting));
  if (!status.config.fault.empty())
    line += fmt::format("; reload refused: {}", brief(status.config.fault));
  return line;
}

}  // namespace crepes
