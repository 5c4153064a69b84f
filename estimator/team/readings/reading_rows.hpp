/// The readings of an interval as rows of the filter's correction.
#pragma once

#include <vector>

#include "estimator/team/readings/reading_scene.hpp"
#include "estimator/team/readings/team_measurement.hpp"
#include "estimator/team/readings/team_readings.hpp"

namespace crepes {

/// One row a sight and one a pair's ranges: the mean of what was not gated. Ranges that are more
/// likely false than true have none. `dy` is what the belief was moved by since it was predicted,
/// as the instant's states have it: whether a range is true is judged by its innovation.
[[nodiscard]] std::vector<TeamRow> linearized(const ReadingScene& scene,
                                              const TeamReadings& readings,
                                              const Eigen::VectorXd& dy);

}  // namespace crepes
