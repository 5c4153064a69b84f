#include "daemon/ctl/live/exposure.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/live/camera_lights.hpp"
#include "daemon/ctl/live/check/robot_check.hpp"
#include "daemon/ctl/live/full_status.hpp"
#include "daemon/ctl/live/light_advice.hpp"
#include "daemon/ctl/live/live_screen.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/base/child_process.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/sleep.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

/// The signal would end any other program.
Result<void> refuse_other_program(pid_t process) {
  std::string name;
  std::ifstream(fmt::format("/proc/{}/comm", process)) >> name;
  if (name == "crepesd") return {};
  return fail(ErrorCode::kUsage,
              name.empty() ? fmt::format("--pid: there is no process {}", process)
                           : fmt::format("--pid: process {} is {}, not crepesd", process, name));
}

/// The daemon reads its files again.
Result<void> request_reload(const ExposureOptions& options) {
  if (options.pid) {
    return refuse_other_program(*options.pid).and_then([&] { return ask_to_reload(*options.pid); });
  }
  constexpr Duration kReloadTime = 10s;
  auto systemctl = ChildProcess::start("/usr/bin/systemctl", {"reload", "crepesd"}, "/dev/null");
  if (!systemctl) return tl::unexpected(systemctl.error());
  const MonotonicClock clock;
  for (const Timestamp end = clock.now() + kReloadTime; clock.now() < end;) {
    if (const auto& ended = systemctl->exit_reason()) {
      if (*ended == "exit code 0") return {};
      return fail(ErrorCode::kIo, "systemctl reload crepesd: " + *ended +
                                      "; of a daemon that is no service, say its --pid");
    }
    sleep_for(20ms);
  }
  return fail(ErrorCode::kIo, "systemctl reload crepesd does not end");
}

/// What STATUS says of the configuration in force.
Result<Json> config_status(const DaemonAddress& daemon) {
  return request_full_status(daemon).map([](const FullStatus& full) {
    return Json::parse(full.json, nullptr, /*allow_exceptions=*/false)
        .value("config", Json::object());
  });
}

/// Waits until a reload after `before` is in force, or was refused. A fault that was there before
/// is of an earlier reload until it has stayed for a while.
Result<void> await_reload(const DaemonAddress& daemon, const Json& before) {
  constexpr Duration kReloadTime = 10s;
  constexpr Duration kOldFault = 3s;
  const MonotonicClock clock;
  const Timestamp begin = clock.now();
  const int generation = before.value("generation", 0);
  for (const Timestamp end = begin + kReloadTime; clock.now() < end; sleep_for(50ms)) {
    const Result<Json> status = config_status(daemon);
    if (!status) return tl::unexpected(status.error());
    if (status->value("generation", 0) > generation) return {};
    const std::string fault = status->value("fault", "");
    const bool is_new = fault != before.value("fault", "") || clock.now() > begin + kOldFault;
    if (!fault.empty() && is_new)
      return fail(ErrorCode::kConfig, "the daemon refused the reload: " + fault);
  }
  return fail(ErrorCode::kIo, "the daemon did not reload; was --config its file?");
}

/// The files of another robot would be changed, and the daemon's light would not.
Result<void> check_same_robot(const ExposureOptions& options, RobotId configured) {
  return request_full_status(options.daemon).and_then([&](const FullStatus& full) -> Result<void> {
    if (full.message.self == configured.value) return {};
    return fail(ErrorCode::kConfig,
                fmt::format("{} is robot {}'s, this daemon is robot {}: name its own file with "
                            "--config, or ask the other robot (--address, --port)",
                            options.config.string(), configured.value, full.message.self));
  });
}

Result<void> apply(const ExposureOptions& options, CameraLights& lights, const CameraLight& light) {
  const Result<Json> before = config_status(options.daemon);
  if (!before) return tl::unexpected(before.error());
  const auto reload = [&] {
    return request_reload(options)
        .and_then([&] { return await_reload(options.daemon, *before); })
        .map_error([](Error error) {
          error.message += "; 90-exposure.yaml has the new values, for the daemon's next start";
          return error;
        });
  };
  return lights.change(light).and_then(reload);
}

std::string setting(const std::optional<double>& value) {
  return value ? fmt::format("{}", *value) : "-";
}

/// The gray levels of a camera's spots; null while they are unknown.
const StatusTotals* levels_of(const client::Status& status, const std::string& camera) {
  const auto* const spots = sensor_of(status, camera + std::string(kSpotsSuffix));
  const bool are_known = spots != nullptr && spots->rate_hz > 0.0 && !spots->counts.empty();
  return are_known ? &spots->counts : nullptr;
}

std::string lights_table(const client::Status& status, const CameraLights& lights) {
  std::vector<std::vector<std::string>> rows{{"camera", "exposure us", "gain", "background",
                                              "threshold", "faintest", "brightest", "lights"}};
  for (const auto& [camera, light] : lights.all()) {
    const StatusTotals* const levels = levels_of(status, camera);
    const std::uint64_t automatic_us = levels == nullptr ? 0 : total(*levels, "auto_exposure_us");
    std::vector<std::string> row{
        camera,
        automatic_us == 0 ? setting(light.exposure_us) : fmt::format("{} auto", automatic_us),
        setting(light.gain)};
    for (const char* name : {"background", "threshold", "faintest", "brightest", "spots"})
      row.push_back(levels == nullptr ? "-" : std::to_string(total(*levels, name)));
    rows.push_back(std::move(row));
  }
  std::string text = text_table(rows);
  for (const CheckFinding& finding : check_exposure(status))
    if (!finding.advice.empty()) text += finding.advice + "\n";
  return text;
}

Json lights_json(const client::Status& status, const CameraLights& lights) {
  Json json{{"cameras", Json::array()}};
  for (const auto& [camera, light] : lights.all()) {
    Json one{{"name", camera}};
    if (light.exposure_us) one["exposure_us"] = *light.exposure_us;
    if (light.gain) one["gain"] = *light.gain;
    if (const StatusTotals* const levels = levels_of(status, camera)) {
      for (const char* name : {"background", "threshold", "faintest", "brightest", "spots"})
        one[name] = total(*levels, name);
      if (const std::uint64_t automatic_us = total(*levels, "auto_exposure_us"); automatic_us > 0)
        one["auto_exposure_us"] = automatic_us;
    }
    json["cameras"].push_back(std::move(one));
  }
  return json;
}

/// What a key asks for; empty for a key without a meaning.
std::optional<CameraLight> wanted_by(char key, const CameraLight& light) {
  constexpr double kStep = 1.25;
  constexpr double kNominalExposure = 500.0;  // us
  const double exposure_us = light.exposure_us.value_or(kNominalExposure);
  const double gain = light.gain.value_or(0.0);
  switch (key) {
    case '+':
      return CameraLight{.exposure_us = exposure_us * kStep, .gain = {}};
    case '-':
      return CameraLight{.exposure_us = exposure_us / kStep, .gain = {}};
    case 'G':
      return CameraLight{.exposure_us = {}, .gain = gain + 1.0};
    case 'g':
      return CameraLight{.exposure_us = {}, .gain = std::max(0.0, gain - 1.0)};
    default:
      return std::nullopt;
  }
}

constexpr const char* kKeys =
    "\n+ - exposure   G g gain   q end   ? help; as short as far boards allow\n";
constexpr const char* kHelp =
    "\n+ and - make the exposure a quarter longer or shorter, G and g the gain a step higher or\n"
    "lower; both are written to crepesd.d/90-exposure.yaml and are in force at once.\n"
    "background, threshold: grey levels of the last second; faintest, brightest: of the lights\n"
    "found. A far board must stay above the threshold, a near one below 255.\n";

/// Until q.
Result<void> show_live(const ExposureOptions& options, CameraLights& lights) {
  StopSignals stop;
  const LiveScreen screen;
  const KeyReader keys;
  std::string refused;
  bool has_help = false;
  while (!stop.requested()) {
    while (const auto key = keys.next()) {
      if (*key == 'q') return {};
      if (*key == '?') has_help = !has_help;
      const auto wanted = wanted_by(*key, lights.light());
      if (!wanted) continue;
      const Result<void> applied = apply(options, lights, *wanted);
      refused = applied ? "" : applied.error().message;
    }
    const Result<FullStatus> status = request_full_status(options.daemon);
    if (!status) return tl::unexpected(status.error());
    screen.show(lights_table(status->message, lights) + kKeys + refused + (has_help ? kHelp : ""));
    sleep_for(100ms);
  }
  return {};
}

Result<void> show_once(const ExposureOptions& options, const CameraLights& lights) {
  const Result<FullStatus> status = request_full_status(options.daemon);
  if (!status) return tl::unexpected(status.error());
  print(options.json ? json_line(lights_json(status->message, lights))
                     : lights_table(status->message, lights));
  return {};
}

}  // namespace

Result<void> exposure(const ExposureOptions& options) {
  constexpr Duration kLevels = 2200ms;  // until STATUS has a whole second of the new light
  Result<CameraLights> lights = CameraLights::load(options.config, options.camera);
  if (!lights) return tl::unexpected(lights.error());
  if (auto same = check_same_robot(options, lights->robot()); !same) return same;
  const bool changes = options.exposure_us || options.gain;
  if (changes) {
    const CameraLight wanted{.exposure_us = options.exposure_us, .gain = options.gain};
    if (auto applied = apply(options, *lights, wanted); !applied) return applied;
  }
  const bool is_live =
      !options.json && !changes && ::isatty(STDIN_FILENO) == 1 && ::isatty(STDOUT_FILENO) == 1;
  if (is_live) return show_live(options, *lights);
  if (changes) sleep_for(kLevels);
  return show_once(options, *lights);
}

}  // namespace crepes
