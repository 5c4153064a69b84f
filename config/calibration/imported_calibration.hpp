/// Calibration files of other programs, converted to our terms.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/reading/config_reader.hpp"
#include "config/schema/config.hpp"

namespace crepes {

struct ImportedCalibration {
  std::vector<CameraCalibration> cameras;
  std::optional<ImuNoise> imu;  ///< the keys of Kalibr's imu.yaml alone
};

/// Kalibr's camchain.yaml, camchain-imucam.yaml and imu.yaml. Faults go to the log.
[[nodiscard]] bool is_kalibr(const ConfigNode& root);
/// With `only_camera`, the others may be of kinds that are not read.
[[nodiscard]] ImportedCalibration read_kalibr(const ConfigNode& root, std::string_view only_camera,
                                              ReadLog& log);

/// Basalt's calibration.json. Faults go to the log.
[[nodiscard]] bool is_basalt(const ConfigNode& root);
[[nodiscard]] ImportedCalibration read_basalt(const ConfigNode& root, ReadLog& log);

/// Detects the format and reads it; `only_camera` as above, empty: all.
[[nodiscard]] ImportedCalibration read_calibration(const ConfigNode& root,
                                                   std::vector<ConfigFault>& faults,
                                                   std::string_view only_camera = {});

/// The sections `cameras` and `imu` of crepesd.yaml. A section without content is left out.
[[nodiscard]] std::string calibration_text(const ImportedCalibration& calibration);

/// Reads a struct with a `visit()` from the mapping at `path`; keys that it does not list are
/// ignored. Returns whether it is free of faults.
template <class Item>
[[nodiscard]] bool read_item(const ConfigNode& node, const std::string& path, Item& item,
                             ReadLog& log) {
  const std::size_t faults_before = log.faults.size();
  ConfigReader reader(node, path, log);
  item.visit(reader);
  reader.ignore_unknown_keys();
  reader.finish();
  return log.faults.size() == faults_before;
}

}  // namespace crepes
