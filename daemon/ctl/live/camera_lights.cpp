#include "daemon/ctl/live/camera_lights.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <system_error>
#include <utility>

#include "config/reading/config_file.hpp"
#include "config/writing/config_writer.hpp"
#include "drivers/base/text_file.hpp"
#include "drivers/dataset/part_file.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

fs::path fragment_of(const fs::path& config, const std::string& name) {
  return config.parent_path() / (config.stem().string() + ".d") / name;
}

std::string lights_text(const std::vector<NamedLight>& lights) {
  std::string text = "# Written by crepesctl exposure.\ncameras:\n";
  for (const auto& [camera, light] : lights) {
    text += fmt::format("  - name: {}\n", camera);
    if (light.exposure_us)
      text += fmt::format("    exposure_us: {}\n", to_yaml(*light.exposure_us));
    if (light.gain) text += fmt::format("    gain: {}\n", to_yaml(*light.gain));
  }
  return text;
}

std::string threshold_text(int threshold) {
  return fmt::format("# Written by the page of crepesctl view.\nvision:\n  threshold: {}\n",
                     threshold);
}

/// As it was before: with its text, or not there.
Result<void> restore(const fs::path& file, const Result<std::string>& before) {
  if (before) return replace_text_file(file, *before);
  std::error_code error;
  fs::remove(file, error);
  return {};
}

/// Writes fragments, by name, that leave the configuration without a fault, or none.
Result<void> write_fragments(const fs::path& config,
                             const std::map<std::string, std::string>& fragments) {
  std::map<fs::path, Result<std::string>> before;
  Result<void> done;
  for (const auto& [name, text] : fragments) {
    const fs::path file = fragment_of(config, name);
    before.emplace(file, read_text_file(file, kMaxConfigBytes));
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    done = replace_text_file(file, text);
    if (!done) break;
  }
  if (done) done = load_config(config).map([](const Config&) {});
  if (done) return {};
  for (const auto& [file, text] : before)
    if (auto restored = restore(file, text); !restored) return restored;
  return done;
}

}  // namespace

Result<CameraLights> CameraLights::load(const fs::path& config, const std::string& camera) {
  const Result<Config> loaded = load_config(config);
  if (!loaded) return tl::unexpected(loaded.error());
  std::vector<NamedLight> lights;
  std::string names;
  for (const CameraConfig& one : loaded->cameras) {
    names += (names.empty() ? "" : ", ") + one.calibration.name;
    lights.push_back({one.calibration.name, one.device.light});
  }
  const auto chosen =
      camera.empty() ? lights.begin() : std::ranges::find(lights, camera, &NamedLight::camera);
  if (chosen == lights.end())
    return fail(ErrorCode::kUsage, fmt::format("no camera \"{}\"; there is {}", camera, names));
  const auto index = static_cast<std::size_t>(chosen - lights.begin());
  return CameraLights(config, loaded->robot.id, std::move(lights), index);
}

Result<void> CameraLights::change(const CameraLight& light, std::optional<int> threshold) {
  std::vector<NamedLight> wanted = lights_;
  if (light.exposure_us) wanted[chosen_].light.exposure_us = light.exposure_us;
  if (light.gain) wanted[chosen_].light.gain = light.gain;
  std::map<std::string, std::string> fragments;
  if (light.exposure_us || light.gain) fragments["90-exposure.yaml"] = lights_text(wanted);
  if (threshold) fragments["90-threshold.yaml"] = threshold_text(*threshold);
  if (auto written = write_fragments(config_, fragments); !written) return written;
  lights_ = std::move(wanted);
  return {};
}

}  // namespace crepes
