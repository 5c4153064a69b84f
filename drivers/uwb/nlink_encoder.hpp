/// Frames as a LinkTrack module sends them, for simulated ones.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/uwb/nlink_frame.hpp"

namespace crepes {

/// The frame that a module with role NODE sends; times are milliseconds of the module's clock.
[[nodiscard]] std::vector<std::uint8_t> encode_node_frame3(std::uint8_t module,
                                                           std::uint32_t system_time_ms,
                                                           const std::vector<NlinkNode>& nodes);

}  // namespace crepes
