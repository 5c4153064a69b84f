/// Where a robot is that nobody has seen, by its ranges and its IMU over some seconds.
#pragma once

#include <deque>
#include <optional>

#include "estimator/team/belief/team_place.hpp"
#include "estimator/team/unseen/range_problem.hpp"

namespace crepes {

/// The robot at the end of intervals that follow each other, by ranges to four or more beacons. A
/// range_track starts nonlinear least squares over all ranges with Huber's weights: unknown are the
/// motion, the IMU's errors, and a constant error a beacon. The mirror image and other headings are
/// tried as well. One that is near and nearly as likely enlarges the covariance so that it contains
/// it. Empty if one elsewhere is, if the place or the attitude is too uncertain, or if too many
/// ranges contradict it.
[[nodiscard]] std::optional<TeamPlace> place_by_ranges(const std::deque<UnseenInterval>& intervals,
                                                       const RangeProblemSettings& settings);

}  // namespace crepes
