/// Three LEDs that are half of a ring of six.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "estimator/vision/ring_model.hpp"
#include "estimator/vision/rings/light_field.hpp"
#include "estimator/vision/rings/ring.hpp"

namespace crepes {

/// The ring of six LEDs of which the three `members` are successive ones. Three lights are weak
/// evidence: they must be parts of one blob, or bright and closer together than robots fly. The
/// places of the other LEDs must be dark. `hexagon`: the round shape of six LEDs.
[[nodiscard]] std::optional<Ring> half_ring_of_six(const LightField& field,
                                                   const RingShape& hexagon,
                                                   std::span<const std::uint32_t> members);

}  // namespace crepes
