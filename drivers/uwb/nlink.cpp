#include "drivers/uwb/nlink.hpp"

#include <fmt/format.h>

namespace crepes {

UwbModules uwb_modules_of(const SwarmConfig& swarm) {
  UwbModules modules;
  for (const MemberConfig& member : swarm.members) {
    modules.emplace(static_cast<std::uint32_t>(member.uwb_id.value_or(member.id.value)), member.id);
  }
  return modules;
}

void NlinkParser::parse(Bytes frame, Timestamp arrival,
                        const std::function<void(const UwbRange&)>& sink) {
  constexpr double kOldestRangeMs = 1000.0;
  const NlinkFrame decoded = decode_nlink(frame);
  last_kind_ = decoded.kind;
  stranger_.reset();
  if (!has_ranges(decoded.kind)) {
    ++counts_.without_ranges;
    return;
  }
  const Timestamp sent = clock_.to_local(
      DeviceTime::ticks(decoded.local_time_ms, std::chrono::milliseconds{1}, 32), arrival);
  counts_.clock_restarts = clock_.restarts();
  for (const NlinkNode& node : decoded.nodes) {
    const auto robot = modules_.find(node.module);
    if (robot == modules_.end()) {
      ++counts_.unknown_modules;
      stranger_ = node.module;
      continue;
    }
    const double age_ms =
        decoded.system_time_ms - node.system_time_ms.value_or(decoded.system_time_ms);
    if (node.range_m <= 0.0 || node.range_m > max_range_m_ || age_ms > kOldestRangeMs) {
      ++counts_.implausible;
      continue;
    }
    ++counts_.ranges;
    sink({.stamp = sent - from_seconds(age_ms * 1e-3),
          .neighbor = robot->second,
          .range_m = node.range_m,
          .first_path_dbm = node.first_path_dbm,
          .received_dbm = node.received_dbm});
  }
}

std::string NlinkParser::no_measurement_reason() const {
  if (!has_ranges(last_kind_)) {
    return fmt::format(
        "the module sends {}, which has no ranges; choose NodeFrame3 with NAssistant",
        name_of(last_kind_));
  }
  if (stranger_) {
    return fmt::format(
        "ranges only to modules that no member carries, such as {}; see swarm.members, uwb_id",
        *stranger_);
  }
  return "the module answers but gives no range to any member; are the others on, and in the same "
         "mode and channel?";
}

}  // namespace crepes
