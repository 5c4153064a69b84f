#include "daemon/ctl/live/status.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/ctl/live/full_status.hpp"
#include "daemon/ctl/live/light_advice.hpp"
#include "daemon/ctl/live/pose_advice.hpp"
#include "daemon/ctl/live/screen_text.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;
using Rows = std::vector<std::vector<std::string>>;

/// For example "gated 3, late 1"; empty without totals.
std::string text_of(const client::Status::Totals& totals) {
  std::string text;
  for (const auto& [name, total] : totals)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, total);
  return text;
}

std::string head_of(const client::Status& status) {
  const double share = status.uptime_s > 0 ? 100.0 * status.cpu_s / status.uptime_s : 0.0;
  return fmt::format("robot {} {}, up {} s, {} % of a core, {} MB\n", status.self, status.name,
                     fixed(status.uptime_s, 0), fixed(share, 1), fixed(status.rss_mb, 0));
}

/// Several faults stand on a line each.
std::string one_line(const std::string& lines) {
  std::string text;
  for (const char c : lines) text += c == '\n' ? std::string("; ") : std::string(1, c);
  return text;
}

/// "imu: silent: is it powered?", in lines as wide as the tables.
std::string note(const std::string& about, const std::string& text) {
  constexpr std::size_t kColumns = 100;
  constexpr std::size_t kIndent = 2;
  return wrapped(fmt::format("{}: {}", about, one_line(text)), kColumns, kIndent) + "\n";
}

/// What is not as the configuration files say; empty if all is.
std::string config_text(const ConfigState& config) {
  std::string text;
  if (!config.fault.empty())
    text += note("configuration", "the last reload was refused: " + config.fault);
  if (!config.restart.empty()) {
    text += note("configuration",
                 "changed, not in use before `systemctl restart crepesd`: " + config.restart);
  }
  return text;
}

std::string sensors_of(const client::Status& status) {
  Rows rows{{"sensor", "rate Hz", "state", "faults", "counts"}};
  std::string notes;
  for (const auto& sensor : status.sensors) {
    rows.push_back({sensor.name, sensor.rate_hz > 0 ? fixed(sensor.rate_hz, 1) : "-",
                    sensor.ok ? "ok" : "fault", text_of(sensor.faults), text_of(sensor.counts)});
    if (!sensor.ok && !sensor.message.empty()) notes += note(sensor.name, sensor.message);
  }
  return text_table(rows, LastColumn::kWords) + notes;
}

std::string neighbors_of(const client::Status& status) {
  Rows rows{{"neighbor", "state", "heard ms ago", "lost %", "lost now %", "clock s", "+- ms", "ppm",
             "why not"}};
  for (const auto& neighbor : status.neighbors) {
    std::vector<std::string> row{
        neighbor.name.empty() ? std::to_string(neighbor.peer) : neighbor.name, neighbor.state};
    const auto& reports = neighbor.reports;
    const double sent = reports ? static_cast<double>(reports->received + reports->lost) : 0.0;
    row.push_back(reports ? fixed(1e3 * reports->age_s, 0) : "-");
    row.push_back(sent > 0 ? fixed(100.0 * static_cast<double>(reports->lost) / sent, 1) : "-");
    row.push_back(reports ? fixed(100.0 * reports->loss, 1) : "-");
    const auto clock =
        std::ranges::find(status.clocks, neighbor.peer, &client::Status::Clock::peer);
    const bool known = clock != status.clocks.end();
    row.push_back(known ? fixed(clock->offset_s, 6) : "-");
    row.push_back(known && clock->sigma_s ? fixed(1e3 * *clock->sigma_s, 3) : "-");
    row.push_back(known && clock->skew_ppm ? fixed(*clock->skew_ppm, 1) : "-");
    row.push_back(neighbor.reason);
    rows.push_back(std::move(row));
  }
  return text_table(rows, LastColumn::kWords);
}

/// What to do where there is no pose, once for each reason.
std::string advice_of(const client::Status& status) {
  std::map<std::string, std::string> neighbors;  // by reason
  for (const auto& neighbor : status.neighbors) {
    std::string& names = neighbors[neighbor.reason];
    names += (names.empty() ? "" : ", ") + neighbor.name;
  }
  std::string text;
  for (const auto& [reason, names] : neighbors) {
    if (const std::string_view advice = advice_for(reason); !advice.empty())
      text += note(fmt::format("{} ({})", reason, names), std::string(advice));
  }
  return text;
}

/// How to change the cameras' exposure.
std::string light_of(const client::Status& status) {
  std::string text;
  for (const auto& sensor : status.sensors) {
    if (!is_spots(sensor) || sensor.rate_hz <= 0.0 || sensor.counts.empty()) continue;
    const std::string advice = light_advice(sensor.counts);
    if (!advice.empty()) text += note(sensor.name, advice);
  }
  return text;
}

/// What the team finds wrong with a robot; on a healthy team this is empty.
std::string faults_of(const client::Status& status) {
  std::string text;
  for (const std::string& fault : status.faults) text += note("this robot", fault);
  for (const auto& neighbor : status.neighbors) {
    for (const std::string& fault : neighbor.faults) text += note(neighbor.name, fault);
  }
  return text;
}

/// "0.123 +- 0.010", of a vector all components and the largest sigma; "-" without an estimate.
std::string text_of(const std::map<std::string, client::Status::Estimate>& estimates,
                    const std::string& key, int digits, double unit = 1.0) {
  const auto found = estimates.find(key);
  if (found == estimates.end()) return "-";
  std::string text;
  for (const double value : found->second.value) text += fixed(unit * value, digits) + " ";
  const auto& sigmas = found->second.sigma;
  const auto largest = std::ranges::max_element(sigmas);
  return text + "+- " + (largest == sigmas.end() ? "-" : fixed(unit * *largest, digits));
}

std::string text_of(const std::map<std::string, client::Status::Residual>& residuals,
                    const std::string& kind) {
  const auto found = residuals.find(kind);
  if (found == residuals.end()) return "-";
  const auto& [nis, fused, refused] = found->second;
  return fmt::format("{} ({} / {})", nis ? fixed(*nis, 2) : "-", fused, refused);
}

/// The residuals of each robot's measurements, and its sensors as the team knows them.
std::string team_of(const client::Status& status) {
  if (!status.team || status.team->robots.empty()) return "";
  Rows residuals{{"team", "trusted", "bearing NIS (fused / refused)", "range NIS", "gyro NIS"}};
  Rows calibrations{{"team", "camera off deg", "antenna cm", "clock ms", "gyro bias deg/s",
                     "accelerometer bias m/s2"}};
  for (const client::Status::TeamRobot& robot : status.team->robots) {
    const std::string name = robot.name.empty() ? std::to_string(robot.robot) : robot.name;
    residuals.push_back({name, robot.trusted ? "yes" : "not yet",
                         text_of(robot.residuals, "bearing"), text_of(robot.residuals, "range"),
                         text_of(robot.residuals, "gyro")});
    std::string cameras;
    for (const client::Status::Camera& camera : robot.cameras)
      cameras += (cameras.empty() ? "" : ", ") + text_of(camera.estimates, "turned_deg", 2);
    calibrations.push_back({name, cameras.empty() ? "-" : cameras,
                            text_of(robot.calibration, "antenna_delay_m", 1, 100.0),
                            text_of(robot.calibration, "clock_ms", 1),
                            text_of(robot.calibration, "gyro_bias_radps", 2, kDegPerRad),
                            text_of(robot.calibration, "accel_bias_mps2", 2)});
  }
  return text_table(residuals) + "\n" + text_table(calibrations) + "\n";
}

std::string mesh_of(const client::Status& status) {
  if (!status.mesh) return "";
  const client::Status::Mesh& mesh = *status.mesh;
  const std::string keys = mesh.sealed ? (mesh.signs ? "sealed and signed" : "sealed, not signed")
                                       : (mesh.signs ? "signed, not sealed" : "open");
  std::string text =
      fmt::format("mesh: {}; {} % of the air, {} % with all that are heard\n", keys,
                  fixed(100.0 * mesh.airtime, 1), fixed(100.0 * mesh.airtime_of_all, 1));
  if (!mesh.warning.empty()) text += note("mesh", mesh.warning);
  return text;
}

/// What had no room in this robot's share of the air.
std::string thinned_of(const client::Status& status) {
  const auto total = [&](const char* name) {
    const auto found = status.network.find(name);
    return found == status.network.end() ? std::uint64_t{0} : found->second;
  };
  const std::uint64_t copies = total("left_out_copies");
  const std::uint64_t samples = total("left_out_samples");
  const std::uint64_t newest = total("left_out_of_datagrams");
  if (copies + samples + newest == 0) return "";
  return note("thinned out",
              fmt::format("{} repeats of bearings and ranges, {} of inertial samples, {} times a "
                          "neighbor's newest",
                          copies, samples, newest));
}

/// Everything refused, lost or dropped; on a healthy robot this is short.
std::string totals_of(const client::Status& status) {
  std::string text;
  if (!status.network.empty()) text += note("network", text_of(status.network));
  if (!status.queues.empty()) text += note("dropped from queues", text_of(status.queues));
  return text;
}

}  // namespace

ConfigState config_state_of(const std::string& status_json) {
  const Json status = Json::parse(status_json, nullptr, /*allow_exceptions=*/false);
  const auto config = status.is_object() ? status.find("config") : status.end();
  if (config == status.end() || !config->is_object()) return {};
  const auto text_of_key = [&](const char* key) {
    const auto found = config->find(key);
    const bool is_text = found != config->end() && found->is_string();
    return is_text ? one_line(found->get<std::string>()) : std::string();
  };
  return {.fault = text_of_key("fault"), .restart = text_of_key("restart")};
}

std::string status_text(const client::Status& status, const ConfigState& config) {
  return fmt::format("{}{}\n{}\n{}\n{}{}{}{}{}{}{}", head_of(status), config_text(config),
                     sensors_of(status), neighbors_of(status), advice_of(status), light_of(status),
                     team_of(status), faults_of(status), mesh_of(status), thinned_of(status),
                     totals_of(status));
}

Result<std::string> status(const StatusOptions& options) {
  return request_full_status(options.daemon).map([&](const FullStatus& full) {
    return options.json ? full.json + "\n" : status_text(full.message, config_state_of(full.json));
  });
}

}  // namespace crepes
