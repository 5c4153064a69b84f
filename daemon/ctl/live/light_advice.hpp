/// What to change about a camera's exposure; pure.
#pragma once

#include <string>

#include "net/client/client.hpp"

namespace crepes {

/// From the `counts` of a camera's spots, in both directions: the brightest board should just be
/// white and the faintest stand out of the noise. Empty if the exposure fits.
[[nodiscard]] std::string light_advice(const client::Status::Totals& counts);

}  // namespace crepes
