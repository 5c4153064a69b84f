/// What two robots measured of each other, with the true association.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/ctl/dataset/truth.hpp"

namespace crepes::study {

/// A recorded swarm and where everybody was.
struct Swarm {
  SwarmDataset dataset;
  SwarmTruth truth;
};

/// One robot's camera on the other's ring.
struct Sighting {
  double true_s = 0.0;
  Eigen::Matrix<double, 3, 2> u_by_px;  ///< how the direction turns with the spot, body axes
  Eigen::Vector3d p_body_camera;
  Eigen::Vector2d residual_px;  ///< spot minus where the calibrated camera expects the true ring
};

struct Ranging {
  double true_s = 0.0;
  double residual_m = 0.0;  ///< measured minus the true distance of the antennas
};

/// Everything that `from` measured of `to`, in order of time.
struct OneWay {
  std::vector<Sighting> sightings;
  std::vector<Ranging> ranges;
};

/// Of each frame the spot nearest to where the ring truly is, if it is near enough to be it; of the
/// ranges those that neither arrived late nor are far off.
[[nodiscard]] OneWay true_sightings(const Swarm& swarm, RobotId from, RobotId to);

/// White noise of one reading, from the differences of successive ones: what is constant or slow
/// cancels. Bearings: an axis.
[[nodiscard]] double bearing_sigma_px(const std::vector<Sighting>& sightings);
[[nodiscard]] double range_sigma_m(const std::vector<Ranging>& ranges);

[[nodiscard]] const RobotRecording& recording_of(const SwarmDataset& dataset, RobotId robot);
[[nodiscard]] const MemberConfig& member_of(const SwarmDataset& dataset, RobotId robot);

}  // namespace crepes::study
