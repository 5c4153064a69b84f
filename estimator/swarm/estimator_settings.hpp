/// All that the estimator of one robot is configured with.
#pragma once

#include <vector>

#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/sensor_noise.hpp"
#include "estimator/core/swarm_config.hpp"
#include "estimator/swarm/estimator_config.hpp"
#include "estimator/vision/vision_config.hpp"

namespace crepes {

struct EstimatorSettings {
  RobotId self{};
  SwarmConfig swarm;                       ///< `self` is a member
  std::vector<CameraCalibration> cameras;  ///< as `SpotFrame::camera` counts them
  ImuNoise imu;
  RangeNoise range;
  VisionConfig vision;
  EstimatorConfig filters;
  double report_rate_hz = 50.0;
  bool solves_graph = true;
  double graph_rate_hz = 10.0;
  bool uses_team_filter = true;  ///< in the tight profile, instead of the pose graph
  std::size_t team_size = 12;    ///< robots that the team's filter estimates jointly

  [[nodiscard]] bool operator==(const EstimatorSettings&) const = default;
};

}  // namespace crepes
