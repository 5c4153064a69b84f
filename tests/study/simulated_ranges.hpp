/// What the ranging module of a simulated robot measures.
#pragma once

#include <vector>

#include "config/schema/config.hpp"
#include "drivers/dataset/robot_clock.hpp"
#include "tests/study/obstacles.hpp"

namespace crepes::study {

enum class RangeModel : std::uint8_t {
  kSimulated,  ///< as SimUwb: 50 Hz of each module, Gaussian noise, a small constant a pair
  kLinkTrack,  ///< thin and with the errors of real modules, see `link_track_error_m`
};

/// The readings of one robot. Obstacles that block the radio make ranges long and late.
[[nodiscard]] std::vector<UwbRange> simulated_ranges(const SimWorld& world, const Config& config,
                                                     const RobotClock& clock, RangeModel model,
                                                     const ObstacleField& obstacles,
                                                     double duration_s);

/// Error of one reading between robots `a` and `b`, as real LinkTrack modules have it (766 000
/// means): a constant of -0.19 to +0.18 m a pair, a scatter of 0.086 m within a second, 5 % of
/// errors beyond 0.39 m and 1 % beyond 0.73 m. That scatter leaves room for large errors only if
/// they last longer than a second, as paths over walls do: a quarter of the spells of 3 s are too
/// long by an exponential of mean 0.21 m.
[[nodiscard]] double link_track_error_m(int seed, RobotId a, RobotId b, double t_s);

/// One sigma of that constant.
inline constexpr double kLinkTrackBias = 0.37 / 3.4641016151377544;

}  // namespace crepes::study
