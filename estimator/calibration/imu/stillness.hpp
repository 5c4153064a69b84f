/// Whether a sensor lay still for a long time.
#pragma once

#include <optional>
#include <span>

namespace crepes {

/// When the readings of one axis first show that the sensor was moved, turned or tilted: the mean
/// of a second differs from that of the minute around it by more than its own noise explains. Empty
/// if they do not, or if there are less than two minutes of them.
[[nodiscard]] std::optional<double> first_motion_s(std::span<const double> readings,
                                                   double period_s);

}  // namespace crepes
