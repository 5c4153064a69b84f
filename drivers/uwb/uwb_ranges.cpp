#include "drivers/uwb/uwb_ranges.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace crepes {
namespace {

constexpr double kOldestRangeMs = 1000.0;
constexpr Duration kRefusalMemory = std::chrono::seconds{2};  // of what was refused

std::uint32_t module_of(const MemberConfig& member) {
  return static_cast<std::uint32_t>(member.uwb_id.value_or(member.id.value));
}

}  // namespace

UwbModules uwb_modules_of(const SwarmConfig& swarm) {
  UwbModules modules;
  for (const MemberConfig& member : swarm.members) modules.emplace(module_of(member), member.id);
  return modules;
}

std::optional<std::uint32_t> uwb_module_of(const SwarmConfig& swarm, RobotId robot) {
  const auto member = std::ranges::find(swarm.members, robot, &MemberConfig::id);
  if (member == swarm.members.end()) return std::nullopt;
  return module_of(*member);
}

std::optional<std::uint32_t> UwbRanges::far_end(const UwbDistance& distance) const {
  if (!distance.from || !own_ || distance.from == own_) return distance.module;
  if (distance.module == own_) return distance.from;
  return std::nullopt;
}

bool UwbRanges::is_plausible(const UwbDistance& distance) const {
  return distance.range_m > 0.0 && distance.range_m <= max_range_m_ &&
         distance.age_ms <= kOldestRangeMs;
}

void UwbRanges::forward(const UwbReading& reading, Timestamp arrival,
                        const std::function<void(const UwbRange&)>& sink) {
  no_ranges_ = reading.no_ranges;
  if (reading.distances.empty() || arrival - refused_at_ > kRefusalMemory) {
    stranger_.reset();
    refused_.reset();
  }
  if (!no_ranges_.empty()) {
    ++counts_.without_ranges;
    return;
  }
  const Timestamp sent = clock_.to_local(reading.time, arrival);
  counts_.clock_restarts = clock_.restarts();
  for (const UwbDistance& distance : reading.distances) {
    const std::optional<std::uint32_t> module = far_end(distance);
    if (!module) continue;
    const auto robot = modules_.find(*module);
    if (robot == modules_.end()) {
      ++counts_.unknown_modules;
      stranger_ = std::min(*module, stranger_.value_or(*module));
      refused_at_ = arrival;
      continue;
    }
    if (!is_plausible(distance)) {
      ++counts_.implausible;
      if (!refused_ || robot->second <= refused_->robot)
        refused_ = Refused{robot->second, distance.age_ms > kOldestRangeMs};
      refused_at_ = arrival;
      continue;
    }
    ++counts_.ranges;
    sink({.stamp = sent - from_seconds(distance.age_ms * 1e-3),
          .neighbor = robot->second,
          .range_m = distance.range_m,
          .first_path_dbm = distance.first_path_dbm,
          .received_dbm = distance.received_dbm});
  }
}

std::string UwbRanges::no_measurement_reason(std::string_view advice) const {
  if (!no_ranges_.empty())
    return fmt::format("the module sends {}, which has no ranges; {}", no_ranges_, advice);
  // The limits alone: a text with what was measured would be logged as another fault each second.
  if (refused_ && refused_->is_old) {
    return fmt::format("the range to robot {} is refused: it is older than {:g} s",
                       refused_->robot.value, kOldestRangeMs * 1e-3);
  }
  if (refused_) {
    return fmt::format(
        "the range to robot {} is refused: it is not above 0 and up to uwb.max_range_m, {:g} m",
        refused_->robot.value, max_range_m_);
  }
  if (stranger_) {
    return fmt::format(
        "ranges only to modules that no member carries, such as {} (0x{:x}); see swarm.members, "
        "uwb_id",
        *stranger_, *stranger_);
  }
  return "the module answers but gives no range to any member; are the others on, and in the same "
         "mode and channel?";
}

}  // namespace crepes
