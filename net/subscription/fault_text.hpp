/// What the team finds wrong with a robot, in words.
#pragma once

#include <string>

#include "estimator/core/team_solution.hpp"

namespace crepes {

/// A sentence about a robot that is named before it.
[[nodiscard]] std::string text_of(const TeamFault& fault);

}  // namespace crepes
