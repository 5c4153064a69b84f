/// What `crepesctl spots` looks at: one camera's pictures or spots, and the robot's gyro.
#pragma once

#include <cstddef>
#include <vector>

#include "daemon/ctl/setup/spots.hpp"
#include "drivers/dataset/picture_list.hpp"

namespace crepes {

struct SpotsRecording {
  std::vector<RecordedPicture> pictures;
  std::vector<SpotFrame> frames;  ///< of a robot's folder without pictures
  std::vector<ImuSample> imu;     ///< empty if there is none
};

/// Reads what belongs to `options.source`. A folder with `cam<k>` is a robot's: camera number
/// `camera` of it counts, and `imu0/data.csv`. Of a `cam<k>`, the `imu0` beside it counts.
[[nodiscard]] Result<SpotsRecording> load_spots_recording(const SpotsOptions& options,
                                                          std::size_t camera, double rate_hz);

}  // namespace crepes
