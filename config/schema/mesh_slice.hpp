/// The parts of a configuration that decide what is sent to peers, and what of theirs is believed.
#pragma once

#include "config/schema/config.hpp"
#include "net/mesh/mesh_trust.hpp"
#include "net/mesh/send_pacing.hpp"

namespace crepes {

/// Reports leave at ticks, so there are at most as many.
[[nodiscard]] double report_rate_hz(const Config& config);

/// Inertial samples are rounded to half of their noise, which adds 2 % to its variance. Without a
/// salt.
[[nodiscard]] SendSettings send_settings(const Config& config);

/// Of a valid configuration. This robot is listed like every other.
[[nodiscard]] MeshTrust mesh_trust(const Config& config);

}  // namespace crepes
