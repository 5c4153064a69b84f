/// A recorded swarm: the measurements of each robot, and how the recording was made.
#pragma once

#include <filesystem>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "drivers/camera/image_folder.hpp"
#include "drivers/dataset/dataset_faults.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The recording of one camera: spots, pictures, or both.
struct CameraRecording {
  std::vector<SpotFrame> spots;
  std::vector<RecordedPicture> images;
};

/// The inputs of one robot. The stamps of each sensor never decrease.
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
  DatasetFaults faults;                ///< the refused rows
};

/// Reads a whole data set. A missing file, a faulty swarm.yaml or crepesd.yaml is an error; a bad
/// row is refused and listed in `faults`. If stamps are out of order, the smallest number of rows
/// is refused that leaves the others in order.
[[nodiscard]] Result<SwarmDataset> load_swarm(const std::filesystem::path& dir);

/// Refuses recordings in which robots carried another's UWB module: they have ranges to themselves.
/// Estimators need not be protected from them, calibrations do.
[[nodiscard]] Result<void> check_modules(const SwarmDataset& swarm);

/// Which files of a robot are read.
struct RecordedSensors {
  bool imu = true;
  bool ranges = true;
  bool cameras = true;
};

/// Reads one robot's folder without its swarm: crepesd.yaml and the files of `sensors`. `dir` may
/// also be a data set of one robot. Refused rows go to `faults`.
[[nodiscard]] Result<RobotRecording> load_robot(const std::filesystem::path& dir,
                                                const RecordedSensors& sensors,
                                                DatasetFaults& faults);

/// One sensor's file of a single robot, whose clock may show any time. Bad rows as in load_swarm().
[[nodiscard]] Result<std::vector<ImuSample>> load_imu(const std::filesystem::path& file,
                                                      DatasetFaults& faults);
[[nodiscard]] Result<std::vector<SpotFrame>> load_spots(const std::filesystem::path& file,
                                                        std::uint8_t camera, DatasetFaults& faults);

}  // namespace crepes
