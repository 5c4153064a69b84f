/// A recorded swarm: what each robot's sensors said, and how the recording was made.
#pragma once

#include <filesystem>
#include <vector>

#include "daemon/ctl/dataset_faults.hpp"
#include "daemon/ctl/swarm_manifest.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

struct RecordedImage {
  Timestamp stamp{};
  std::filesystem::path file;
};

/// What a camera recorded: spots, or pictures, or both.
struct CameraRecording {
  std::vector<SpotFrame> spots;
  std::vector<RecordedImage> images;
};

/// One robot's inputs; the stamps of each sensor never go back.
struct RobotRecording {
  SwarmRobot robot;
  std::filesystem::path config_file;
  Config config;
  std::vector<ImuSample> imu;
  std::vector<UwbRange> ranges;
  std::vector<CameraRecording> cameras;  ///< one for each of config.cameras
};

struct SwarmDataset {
  SwarmManifest manifest;
  std::vector<RobotRecording> robots;  ///< in the manifest's order
  DatasetFaults faults;                ///< rows that were refused; all others are here
};

/// Reads a whole data set. A missing file, a faulty swarm.yaml or crepesd.yaml is an error; a bad
/// row is refused and told in `faults`. A stamp outside the recording or out of order costs the
/// fewest rows that leave the others in order.
[[nodiscard]] Result<SwarmDataset> load_swarm(const std::filesystem::path& dir);

}  // namespace crepes
