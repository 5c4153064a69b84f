#include "daemon/ctl/setup/import_calibration.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "config/calibration/imported_calibration.hpp"
#include "config/reading/config_file.hpp"
#include "config/writing/config_writer.hpp"
#include "daemon/ctl/json_line.hpp"
#include "drivers/base/text_file.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

ImportedCalibration parse_calibration(const std::string& text, const std::string& file,
                                      std::vector<ConfigFault>& faults) {
  const std::size_t faults_before = faults.size();
  const ConfigNode root = parse_yaml(text, file, faults);  // JSON is YAML, too
  return faults.size() > faults_before ? ImportedCalibration{} : read_calibration(root, faults);
}

/// Adds what `more` has; a fault where both have the same thing.
void join(ImportedCalibration& all, ImportedCalibration more, const std::string& file,
          std::vector<ConfigFault>& faults) {
  for (CameraCalibration& camera : more.cameras) {
    if (std::ranges::count(all.cameras, camera.name, &CameraCalibration::name) > 0)
      faults.push_back({file, 1, camera.name, "is in another file, too"});
    all.cameras.push_back(std::move(camera));
  }
  if (all.imu && more.imu) faults.push_back({file, 1, "imu", "is in another file, too"});
  if (more.imu) all.imu = more.imu;
}

Json json_of(const CameraCalibration& camera) {
  const bool is_double_sphere = camera.camera_model == CameraModelKind::kDoubleSphere;
  Json json{{"name", camera.name}, {"camera_model", is_double_sphere ? "ds" : "pinhole"}};
  json["intrinsics"] = camera.intrinsics;
  if (!is_double_sphere) {
    json["distortion_model"] = "equidistant";
    json["distortion_coeffs"] = camera.distortion_coeffs;
  }
  json["resolution"] = camera.resolution;
  json["T_cam_imu"] =
      Json::parse(to_yaml(camera.T_cam_imu));  // rows of numbers look the same in JSON
  json["timeshift_cam_imu"] = camera.timeshift_cam_imu;
  if (!camera.calibrated) json["calibrated"] = false;
  return json;
}

Json json_of(const ImuNoise& imu) {
  return {{"update_rate", imu.update_rate},
          {"accelerometer_noise_density", imu.accelerometer_noise_density},
          {"gyroscope_noise_density", imu.gyroscope_noise_density},
          {"accelerometer_random_walk", imu.accelerometer_random_walk},
          {"gyroscope_random_walk", imu.gyroscope_random_walk}};
}

Json json_of(const ImportedCalibration& calibration) {
  Json json = Json::object();
  for (const CameraCalibration& camera : calibration.cameras)
    json["cameras"].push_back(json_of(camera));
  if (calibration.imu) json["imu"] = json_of(*calibration.imu);
  return json;
}

/// The faults of these sections as part of a configuration; faults of missing sections are ignored.
std::vector<ConfigFault> faults_here(const std::string& sections) {
  std::vector<ConfigFault> faults = check_config_text(sections, "as imported").faults;
  std::erase_if(faults, [](const ConfigFault& fault) {
    const bool is_section = fault.key == "cameras";  // not imported, so not missing here
    return is_section || (!is_in(fault, &Config::cameras) && !is_in(fault, &Config::imu));
  });
  return faults;
}

}  // namespace

Result<std::string> import_calibration(const std::vector<std::filesystem::path>& files, bool json) {
  ImportedCalibration all;
  std::vector<ConfigFault> faults;
  std::string names;
  for (const std::filesystem::path& file : files) {
    const Result<std::string> text = read_text_file(file, kMaxConfigBytes);
    if (!text) return tl::unexpected(text.error());
    join(all, parse_calibration(*text, file.string(), faults), file.string(), faults);
    names += (names.empty() ? "" : ", ") + file.filename().string();
  }
  const std::string sections = calibration_text(all);
  if (faults.empty()) faults = faults_here(sections);
  if (!faults.empty()) return fail(ErrorCode::kConfig, to_string(faults));
  if (json) return json_line(json_of(all));
  return fmt::format("# Imported by crepesctl import-calibration from {}\n{}", names, sections);
}

}  // namespace crepes
