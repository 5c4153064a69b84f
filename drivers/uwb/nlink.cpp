#include "drivers/uwb/nlink.hpp"

#include <chrono>

namespace crepes {

UwbReading Nlink::read(Bytes frame) {
  const NlinkFrame decoded = decode_nlink(frame);
  if (!has_ranges(decoded.kind)) return {.no_ranges = name_of(decoded.kind)};
  UwbReading reading;
  if (decoded.has_clock)
    reading.time = DeviceTime::ticks(decoded.local_time_ms, std::chrono::milliseconds{1}, 32);
  for (const NlinkNode& node : decoded.nodes) {
    // Modulo 2^32: a range of the future is very old.
    const std::uint32_t age_ms =
        decoded.system_time_ms - node.system_time_ms.value_or(decoded.system_time_ms);
    reading.distances.push_back({.module = node.module,
                                 .range_m = node.range_m,
                                 .first_path_dbm = node.first_path_dbm,
                                 .received_dbm = node.received_dbm,
                                 .age_ms = static_cast<double>(age_ms)});
  }
  return reading;
}

}  // namespace crepes
