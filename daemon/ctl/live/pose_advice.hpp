/// What to do where there is no pose: one table for `status`, `check` and the page of `view`.
#pragma once

#include <string_view>

#include "estimator/core/outputs.hpp"

namespace crepes {

/// A sentence or two; at length in config/docs/troubleshooting.md. Empty for kNone.
[[nodiscard]] std::string_view advice_for(NoPoseReason reason);
/// By the reason's name in STATUS; empty for a name that is none.
[[nodiscard]] std::string_view advice_for(std::string_view reason);

}  // namespace crepes
