#include "daemon/ctl/import_calibration.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>

#include "daemon/config_file.hpp"
#include "daemon/config_writer.hpp"
#include "daemon/ctl/csv_file.hpp"
#include "daemon/ctl/imported_calibration.hpp"

namespace crepes {
namespace {

constexpr std::size_t kMaxFileBytes = 1 << 20;

ImportedCalibration read_root(const YAML::Node& root, ReadLog& log) {
  if (is_basalt(root)) return read_basalt(root, log);
  if (is_kalibr(root)) return read_kalibr(root, log);
  log.fault("",
            "neither a camchain nor an imu.yaml of Kalibr (cam0, imu0, update_rate), nor a "
            "calibration of Basalt (value0)");
  return {};
}

ImportedCalibration read_text(const std::string& text, const std::string& file,
                              std::vector<ConfigFault>& faults) {
  ReadLog log;
  log.file = file;
  ImportedCalibration calibration;
  try {
    calibration = read_root(YAML::Load(text), log);  // JSON is YAML, too
  } catch (const YAML::Exception& e) {
    log.faults.push_back(
        {log.file, e.mark.is_null() ? 1 : e.mark.line + 1, "", "not YAML or JSON: " + e.msg});
  }
  std::ranges::move(log.faults, std::back_inserter(faults));
  return calibration;
}

/// Adds what `more` has; a fault where both have the same thing.
void join(ImportedCalibration& all, ImportedCalibration more, const std::string& file,
          std::vector<ConfigFault>& faults) {
  for (CameraConfig& camera : more.cameras) {
    if (std::ranges::count(all.cameras, camera.name, &CameraConfig::name) > 0)
      faults.push_back({file, 1, camera.name, "is in another file, too"});
    all.cameras.push_back(std::move(camera));
  }
  if (all.imu && more.imu) faults.push_back({file, 1, "imu", "is in another file, too"});
  if (more.imu) all.imu = more.imu;
}

template <class T>
std::string line_of(std::string_view indent, std::string_view key, const T& value) {
  return std::string(indent) + std::string(key) + ": " + yaml_of(value) + '\n';
}

std::string camera_text(const CameraConfig& camera) {
  constexpr std::string_view kIndent = "    ";
  const bool is_double_sphere = camera.camera_model == CameraModelKind::kDoubleSphere;
  std::string text = "  - name: " + camera.name + "\n    camera_model: ";
  text += is_double_sphere ? "ds\n" : "pinhole\n";
  text += line_of(kIndent, "intrinsics", camera.intrinsics);
  if (!is_double_sphere) {
    text += "    distortion_model: equidistant\n";
    text += line_of(kIndent, "distortion_coeffs", camera.distortion_coeffs);
  }
  text += line_of(kIndent, "resolution", camera.resolution);
  text += line_of(kIndent, "T_cam_imu", camera.T_cam_imu);
  return text + line_of(kIndent, "timeshift_cam_imu", camera.timeshift_cam_imu);
}

std::string imu_text(const ImuConfig& imu) {
  constexpr std::string_view kIndent = "  ";
  return "imu:\n" + line_of(kIndent, "update_rate", imu.update_rate) +
         line_of(kIndent, "accelerometer_noise_density", imu.accelerometer_noise_density) +
         line_of(kIndent, "gyroscope_noise_density", imu.gyroscope_noise_density) +
         line_of(kIndent, "accelerometer_random_walk", imu.accelerometer_random_walk) +
         line_of(kIndent, "gyroscope_random_walk", imu.gyroscope_random_walk);
}

std::string sections_text(const ImportedCalibration& calibration) {
  std::string text;
  if (!calibration.cameras.empty()) text += "cameras:\n";
  for (const CameraConfig& camera : calibration.cameras) text += camera_text(camera);
  if (calibration.imu) text += imu_text(*calibration.imu);
  return text;
}

/// What our own configuration says against these sections; the rest of it is not there.
std::vector<ConfigFault> faults_here(const std::string& sections) {
  std::vector<ConfigFault> faults = check_config_text(sections, "as imported").faults;
  std::erase_if(faults, [](const ConfigFault& fault) {
    return !fault.key.starts_with("cameras[") && !fault.key.starts_with("imu.");
  });
  return faults;
}

}  // namespace

Result<std::string> import_calibration(const std::vector<std::filesystem::path>& files) {
  ImportedCalibration all;
  std::vector<ConfigFault> faults;
  std::string names;
  for (const std::filesystem::path& file : files) {
    const Result<std::string> text = read_text_file(file);
    if (!text) return tl::unexpected(text.error());
    if (text->size() > kMaxFileBytes)
      return fail(ErrorCode::kFormat, file.string() + ": is larger than 1 MiB");
    join(all, read_text(*text, file.string(), faults), file.string(), faults);
    names += (names.empty() ? "" : ", ") + file.filename().string();
  }
  const std::string sections = sections_text(all);
  if (faults.empty()) faults = faults_here(sections);
  if (!faults.empty()) {
    std::string message;
    for (const ConfigFault& fault : faults)
      message += (message.empty() ? "" : "\n") + to_string(fault);
    return fail(ErrorCode::kConfig, std::move(message));
  }
  return "# Imported by crepesctl import-calibration from " + names + "\n" + sections;
}

}  // namespace crepes
