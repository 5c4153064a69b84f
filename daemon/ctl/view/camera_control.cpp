#include "daemon/ctl/view/camera_control.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <optional>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/live/camera_lights.hpp"
#include "daemon/ctl/live/daemon_access.hpp"
#include "drivers/base/number_text.hpp"

namespace crepes {
namespace {

/// Empty if it is not among those wanted.
template <class Number>
Result<std::optional<Number>> number_in(const std::map<std::string, std::string>& wanted,
                                        const char* key, Number least, Number most) {
  const auto found = wanted.find(key);
  if (found == wanted.end()) return std::nullopt;
  Number value{};
  if (!parse_number(found->second, value).empty() || value < least || value > most)
    return fail(ErrorCode::kUsage, fmt::format("{}: {} to {}", key, least, most));
  return value;
}

/// The configuration that the page may change.
Result<Config> own_config(const CameraFeed& feed, const std::filesystem::path& file) {
  if (!feed.config() || !feed.config()->view.control)
    return fail(ErrorCode::kUsage, "view.control is false in the daemon's configuration");
  auto config = load_config(file);
  if (config && config->robot.id != feed.config()->robot.id)
    return fail(ErrorCode::kUsage, file.string() + ": not the configuration of this daemon");
  return config;
}

}  // namespace

Result<void> change_camera(const CameraFeed& feed, const std::filesystem::path& file,
                           std::size_t camera, const std::map<std::string, std::string>& wanted) {
  const auto config = own_config(feed, file);
  if (!config) return tl::unexpected(config.error());
  const auto daemon = feed.daemon_pid();
  if (!daemon) return fail(ErrorCode::kIo, "the daemon does not answer");
  if (camera >= config->cameras.size()) return fail(ErrorCode::kUsage, "no such camera");
  const auto exposure_us = number_in(wanted, "exposure_us", 1.0, 100000.0);
  const auto gain = number_in(wanted, "gain", 0.0, 1000.0);
  const auto threshold = number_in(wanted, "threshold", 0, 255);
  if (!exposure_us) return tl::unexpected(exposure_us.error());
  if (!gain) return tl::unexpected(gain.error());
  if (!threshold) return tl::unexpected(threshold.error());
  auto lights = CameraLights::load(file, config->cameras[camera].calibration.name);
  if (!lights) return tl::unexpected(lights.error());
  auto changed = lights->change({.exposure_us = *exposure_us, .gain = *gain}, *threshold);
  if (!changed) return changed;
  return ask_to_reload(*daemon);
}

}  // namespace crepes
