#include "daemon/service_line.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <vector>

namespace crepes {
namespace {

constexpr std::size_t kMaxPart = 200;  // bytes

/// Only the first line of what may be many, so that the whole stays one.
std::string_view brief(std::string_view text) {
  return text.substr(0, std::min(text.find('\n'), kMaxPart));
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
      append(others, ", ", neighbor.name + ": " + std::string(name_of(neighbor.reason)));
    }
  }
  std::string line = std::to_string(located) + " of " + std::to_string(neighbors.size()) +
                     (neighbors.size() == 1 ? " neighbor" : " neighbors") + " located";
  if (!others.empty()) line += " (" + std::string(brief(others)) + ")";
  return line;
}

}  // namespace

std::string service_line(const SystemStatus& status) {
  std::string line = neighbors_line(status.estimator.neighbors);
  std::string faults;
  for (const SensorStatus& sensor : status.sensors) {
    if (!sensor.ok) append(faults, "; ", sensor.name + ": " + sensor.message);
  }
  if (!faults.empty()) append(line, "; ", brief(faults));
  std::string waiting;
  for (const std::string& key : status.config.restart) append(waiting, ", ", key);
  if (!waiting.empty()) line += "; restart to apply: " + std::string(brief(waiting));
  if (!status.config.fault.empty())
    line += "; reload refused: " + std::string(brief(status.config.fault));
  return line;
}

}  // namespace crepes
