/// The part of a configuration that decides what is sent to peers.
#pragma once

#include "config/schema/config.hpp"
#include "net/mesh/send_pacing.hpp"

namespace crepes {

/// Inertial samples are rounded to half of their noise, which adds 2 % to its variance. Without a
/// salt.
[[nodiscard]] SendSettings send_settings(const Config& config);

}  // namespace crepes
