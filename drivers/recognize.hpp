/// Which protocol stands in some bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/serial/frame_decoder.hpp"

namespace crepes {

enum class SpokenProtocol : std::uint8_t { kNlink, kWitMotion, kHipnuc, kXsens, kMavlink };

/// As the configuration calls it; of NLink, as people do.
[[nodiscard]] std::string_view name_of(SpokenProtocol protocol);

/// The protocol of which at least three frames fill at least a quarter of `recent` (autopilots send
/// much that we do not know); empty when none does. `recent` may begin and end anywhere in a frame.
[[nodiscard]] std::optional<SpokenProtocol> recognize(Bytes recent);

}  // namespace crepes
