#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/ctl/replay/replay_output.hpp"
#include "drivers/base/text_file.hpp"
#include "estimator/core/contract.hpp"
#include "net/subscription/json_parts.hpp"
#include "net/subscription/team_json.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

const std::string& name_in(const ReplayOutput::Names& names, RobotId robot) {
  const auto found = names.find(robot);
  CREPES_EXPECT(found != names.end(), "a robot without a name");
  return found->second;
}

template <class Value>
Json object_of(const std::vector<std::pair<std::string, Value>>& entries) {
  Json object = Json::object();
  for (const auto& [key, value] : entries) object[key] = value;
  return object;
}

/// Measurements of one pair by kind and verdict.
Json measurements_json(const NeighborStatus& neighbor) {
  Json kinds = Json::object();
  for (std::size_t kind = 0; kind < kMeasurementKindCount; ++kind) {
    Json verdicts = Json::object();
    for (std::size_t verdict = 0; verdict < kVerdictCount; ++verdict) {
      verdicts[std::string(name_of(static_cast<Verdict>(verdict)))] =
          neighbor.measurements.at(kind).at(verdict);
    }
    kinds[std::string(name_of(static_cast<MeasurementKind>(kind)))] = std::move(verdicts);
  }
  return kinds;
}

/// Refused inertial samples by reason, if there are any.
Json refused_imu_json(const ImuFaultCounts& counts) {
  Json json = Json::object();
  for (std::size_t fault = 0; fault < kImuFaultCount; ++fault) {
    if (counts.at(fault) > 0)
      json[std::string(name_of(static_cast<ImuFault>(fault)))] = counts.at(fault);
  }
  return json;
}

Json pair_json(const RobotReport& robot, const NeighborStatus& neighbor,
               const ReplayOutput::Names& names) {
  Json pair;
  pair["observer"] = name_in(names, robot.robot);
  pair["neighbor"] = neighbor.name;
  pair["measurements"] = measurements_json(neighbor);
  pair["id_decodes"] = neighbor.id_decodes;
  pair["refused_imu"] = refused_imu_json(neighbor.refused_imu);
  if (robot.id_mistakes) {
    const auto found = robot.id_mistakes->find(neighbor.neighbor);
    pair["id_mistakes"] = found == robot.id_mistakes->end() ? 0 : found->second;
  }
  pair["at_end"] = neighbor.pose ? name_of(neighbor.pose->mode) : name_of(neighbor.reason);
  return pair;
}

/// The robots as this one's team filter knows them at the end.
Json team_json(const RobotReport& robot, const ReplayOutput::Names& names) {
  Json team;
  team["robots"] = Json::array();
  for (const TeamRobotStatus& one : robot.status.team->robots) {
    team["robots"].push_back(team_robot_json(one, name_in(names, one.calibration.robot),
                                             robot.robot, TeamDetail::kFull));
  }
  return team;
}

Json robot_json(const RobotReport& robot, const ReplayOutput::Names& names) {
  Json json;
  json["name"] = name_in(names, robot.robot);
  json["datagrams_sent"] = robot.datagrams_sent;
  json["bytes_sent"] = robot.bytes_sent;
  json["airtime"] = robot.airtime;
  json["network"] = object_of(robot.network);
  json["refused_samples"] = robot.status.refused_samples;
  json["refused_imu"] = refused_imu_json(robot.status.refused_imu);
  json["unknown_senders"] = robot.status.unknown_senders;
  json["predicted_ids"] = {{"confirmed", robot.status.predicted_ids.confirmed},
                           {"unconfirmed", robot.status.predicted_ids.unconfirmed}};
  json["foreign_boards"] = robot.status.foreign_boards;
  json["cpu_s"] = object_of(robot.cpu_s);
  if (robot.status.team) json["team"] = team_json(robot, names);
  return json;
}

Json clock_json(const ClockSample& sample, const ReplayOutput::Names& names) {
  Json json;
  json["observer"] = name_in(names, sample.observer);
  json["peer"] = name_in(names, sample.clock.peer);
  json["t_s"] = to_seconds(sample.stamp.time_since_epoch());
  json["offset_s"] = sample.clock.offset_s;
  json["skew_ppm"] = sample.clock.skew_ppm;
  json["sigma_s"] = sample.clock.sigma_s;
  return json;
}

RobotId id_of(const std::string& name, const ReplayOutput::Names& names) {
  for (const auto& [id, known] : names)
    if (known == name) return id;
  throw nlohmann::json::other_error::create(0, fmt::format("no robot '{}'", name), nullptr);
}

ClockSample clock_from(const Json& json, const ReplayOutput::Names& names) {
  constexpr double kLongest = 8e9;  // s; its nanoseconds fit 64 bits
  const double t_s = json.at("t_s").get<double>();
  if (!(std::abs(t_s) < kLongest))
    throw nlohmann::json::other_error::create(0, "t_s out of range", nullptr);
  return {.observer = id_of(json.at("observer").get<std::string>(), names),
          .stamp = Timestamp{from_seconds(t_s)},
          .clock = {.peer = id_of(json.at("peer").get<std::string>(), names),
                    .offset_s = json.at("offset_s").get<double>(),
                    .skew_ppm = json.at("skew_ppm").get<double>(),
                    .sigma_s = json.value("sigma_s", 0.0)}};
}

std::string recording_text(const std::string& scenario, double duration_s) {
  return fmt::format("scenario {}, {} s", scenario, duration_s);
}

Error no_report(const std::filesystem::path& file) {
  return {ErrorCode::kFormat,
          file.string() + ": not the whole report of a replay; was it cut off? Replay again"};
}

}  // namespace

std::string report_json(const ReplayReport& report, const ReplayOutput::Names& names) {
  Json json;
  json["scenario"] = report.scenario;
  json["profile"] = report.profile;
  json["graph"] = report.graph;
  json["seed"] = report.seed;
  json["duration_s"] = report.duration_s;
  json["pairs"] = Json::array();
  json["robots"] = Json::array();
  json["clocks"] = Json::array();
  for (const RobotReport& robot : report.robots) {
    json["robots"].push_back(robot_json(robot, names));
    for (const NeighborStatus& neighbor : robot.status.neighbors)
      json["pairs"].push_back(pair_json(robot, neighbor, names));
  }
  for (const ClockSample& sample : report.clocks)
    json["clocks"].push_back(clock_json(sample, names));
  json["faults"] = {{"counts", report.faults.counts()}, {"list", report.faults.list()}};
  return dump(json, 2) + "\n";
}

Result<std::vector<ClockSample>> read_clock_samples(const std::filesystem::path& file,
                                                    const ReplayOutput::Names& names) {
  const Result<std::string> text = read_text_file(file);
  if (!text) return tl::unexpected(text.error());
  try {
    const Json report = Json::parse(*text);
    std::vector<ClockSample> samples;
    for (const Json& sample : report.at("clocks")) samples.push_back(clock_from(sample, names));
    return samples;
  } catch (const nlohmann::json::exception&) {
    return tl::unexpected(no_report(file));
  }
}

Result<void> check_same_recording(const std::filesystem::path& results,
                                  const SwarmManifest& manifest) {
  constexpr double kSame = 1e-3;  // s
  const std::filesystem::path file = results / "report.json";
  const Result<std::string> text = read_text_file(file);
  if (!text && text.error().code == ErrorCode::kNotFound) return {};
  if (!text) return tl::unexpected(text.error());
  try {
    const Json report = Json::parse(*text);
    const std::string scenario = report.value("scenario", "");
    const double duration_s = report.value("duration_s", 0.0);
    const bool is_other =
        !scenario.empty() && !manifest.scenario.empty() && scenario != manifest.scenario;
    const bool is_longer = duration_s > 0.0 && manifest.duration_s > 0.0 &&
                           std::abs(duration_s - manifest.duration_s) > kSame;
    if (!is_other && !is_longer) return {};
    return fail(ErrorCode::kConfig,
                fmt::format("{} is of another recording ({}) than the truth ({})", file.string(),
                            recording_text(scenario, duration_s),
                            recording_text(manifest.scenario, manifest.duration_s)));
  } catch (const nlohmann::json::exception&) {
    return tl::unexpected(no_report(file));
  }
}

}  // namespace crepes
