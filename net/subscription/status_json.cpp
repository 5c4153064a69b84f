#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "net/subscription/fault_text.hpp"
#include "net/subscription/json_parts.hpp"
#include "net/subscription/subscription_json.hpp"
#include "net/subscription/team_json.hpp"

namespace crepes {
namespace {

using Json = OrderedJson;

constexpr std::size_t kShortText = 60;  ///< bytes of a message where space is short

void put_total(Json& object, const std::string& name, std::uint64_t total) {
  if (total > 0) object[truncated_utf8(name, kMaxName)] = total;
}

Json totals_json(const Totals& totals) {
  Json json = Json::object();
  for (const auto& [name, total] : totals) put_total(json, name, total);
  return json;
}

Json sensor_json(const SensorStatus& sensor) {
  Json json{{"name", truncated_utf8(sensor.name, kMaxName)}};
  put(json, "rate_hz", sensor.rate_hz, 4);
  json["ok"] = sensor.ok;
  if (!sensor.is_calibrated) json["calibrated"] = false;
  if (!sensor.message.empty()) json["message"] = truncated_utf8(sensor.message, kMaxText);
  if (Json faults = totals_json(sensor.totals.faults); !faults.empty())
    json["faults"] = std::move(faults);
  if (Json counts = totals_json(sensor.totals.counts); !counts.empty())
    json["counts"] = std::move(counts);
  return json;
}

/// Adds `refused_imu` if there is any.
void put_refused_imu(Json& json, const ImuFaultCounts& counts) {
  for (std::size_t fault = 0; fault < kImuFaultCount; ++fault) {
    if (counts.at(fault) > 0)
      json["refused_imu"][std::string(name_of(static_cast<ImuFault>(fault)))] = counts.at(fault);
  }
}

/// Adds `faults` if there are any, as sentences about a robot that has a name.
void put_faults(Json& json, const std::vector<TeamFault>& faults) {
  for (const TeamFault& fault : faults) json["faults"].push_back(text_of(fault));
}

Json head_json(const SystemStatus& status) {
  Json json{{"class", "STATUS"},
            {"self", status.self.value},
            {"name", truncated_utf8(status.name, kMaxName)}};
  put(json, "uptime_s", status.uptime_s, 9);
  return json;
}

Json neighbor_json(const NeighborStatus& neighbor) {
  Json json{{"peer", neighbor.neighbor.value}, {"name", truncated_utf8(neighbor.name, kMaxName)}};
  json["state"] = neighbor.pose ? name_of(neighbor.pose->mode) : "none";
  if (neighbor.pose) {
    put(json, "age_s", neighbor.pose->age_s, 3);
  } else {
    json["reason"] = name_of(neighbor.reason);
  }
  json["id_decodes"] = neighbor.id_decodes;
  for (std::size_t kind = 0; kind < kMeasurementKindCount; ++kind) {
    for (std::size_t verdict = 0; verdict < kVerdictCount; ++verdict) {
      if (const auto total = neighbor.measurements.at(kind).at(verdict); total > 0) {
        json["measurements"][std::string(name_of(static_cast<MeasurementKind>(kind)))]
            [std::string(name_of(static_cast<Verdict>(verdict)))] = total;
      }
    }
  }
  put_refused_imu(json, neighbor.refused_imu);
  put_faults(json, neighbor.faults);
  return json;
}

/// Ages of all data that a pose of the neighbor depends on.
Json ages_json(const NeighborStatus& neighbor, Timestamp now) {
  Json json = Json::object();
  for (std::size_t kind = 0; kind < kMeasurementKindCount; ++kind) {
    if (const auto& newest = neighbor.newest.at(kind)) {
      put(json, std::string(name_of(static_cast<MeasurementKind>(kind))).c_str(),
          to_seconds(now - newest->stamp), 3);
    }
  }
  if (neighbor.newest_imu) put(json, "imu", to_seconds(now - *neighbor.newest_imu), 3);
  return json;
}

/// Lengths and components of directions, to a tenth of a millimeter or of a milliradian.
Json numbers_json(std::span<const double> numbers) {
  Json json = Json::array();
  for (const double number : numbers) json.push_back(std::round(1e4 * number) / 1e4);
  return json;
}

Json vector_json(const Eigen::Vector3d& v) { return numbers_json({v.data(), 3}); }

bool is_finite(const NewestReading& newest) {
  return std::ranges::all_of(newest.reading, [](double number) { return std::isfinite(number); });
}

/// What was measured, without any estimate. A bearing leads from the seeing robot's camera to the
/// other one's ring, a range from our antenna to the neighbor's; each end in its own robot's body.
Json measured_json(const NeighborStatus& neighbor) {
  Json json = Json::object();
  const auto put_reading = [&](MeasurementKind kind, const auto& about) {
    const auto& newest = neighbor.newest.at(static_cast<std::size_t>(kind));
    if (!newest || newest->reading == SensorReading{} || !is_finite(*newest)) return;
    Json& one = json[std::string(name_of(kind))] = about(newest->reading);
    if (newest->verdict == Verdict::kGated) one["gated"] = true;
  };
  const auto bearing_to = [](const Eigen::Vector3d& ring) {
    return [&ring](const SensorReading& z) {
      return Json{{"u", numbers_json(std::span(z).first(3))},
                  {"from", numbers_json(std::span(z).last(3))},
                  {"to", vector_json(ring)}};
    };
  };
  const PairMounting& mounting = neighbor.mounting;
  const auto range = [&mounting](const SensorReading& z) {
    return Json{{"m", numbers_json(std::span(z).first(1))[0]},
                {"from", vector_json(mounting.p_B_U)},
                {"to", vector_json(mounting.p_N_Q)}};
  };
  put_reading(MeasurementKind::kBearing, bearing_to(mounting.p_N_M));
  put_reading(MeasurementKind::kPeerBearing, bearing_to(mounting.p_B_M));
  put_reading(MeasurementKind::kRange, range);
  put_reading(MeasurementKind::kPeerRange, range);
  put_reading(MeasurementKind::kRingDistance, [&mounting](const SensorReading& z) {
    return Json{{"m", numbers_json(std::span(z).first(1))[0]}, {"to", vector_json(mounting.p_N_M)}};
  });
  return json;
}

Json traffic_json(const PeerTraffic& traffic) {
  Json json{{"received", traffic.received}, {"lost", traffic.lost}, {"restarts", traffic.restarts}};
  put(json, "age_s", traffic.age_s, 3);
  put(json, "loss", traffic.loss, 2);
  return json;
}

Json clock_json(const ClockStatus& clock) {
  Json json{{"peer", clock.peer.value}};
  put(json, "offset_s", clock.offset_s, 12);
  put(json, "skew_ppm", clock.skew_ppm, 4);
  put(json, "sigma_s", clock.sigma_s, 3);
  return json;
}

Json config_json(const SystemStatus& status) {
  Json json{{"generation", status.config.generation}};
  put(json, "age_s", status.config_age_s, 5);
  std::string keys;
  for (const std::string& key : status.config.restart) keys += (keys.empty() ? "" : ", ") + key;
  if (!keys.empty()) json["restart"] = truncated_utf8(keys, kMaxText);
  if (!status.config.fault.empty()) json["fault"] = truncated_utf8(status.config.fault, kMaxText);
  return json;
}

void put_sensors(Json& json, const SystemStatus& status) {
  json["sensors"] = Json::array();
  for (const SensorStatus& sensor : status.sensors) json["sensors"].push_back(sensor_json(sensor));
}

Json mesh_json(const MeshStatus& mesh) {
  Json json{{"sealed", mesh.is_sealed}, {"signed", mesh.is_signed}};
  if (!mesh.warning.empty()) json["warning"] = truncated_utf8(mesh.warning, kMaxText);
  put(json, "airtime", mesh.air.own, 3);
  put(json, "airtime_of_all", mesh.air.all, 3);
  return json;
}

void put_network(Json& json, const SystemStatus& status) {
  json["queues"] = Json::object();
  for (const QueueStatus& queue : status.queues)
    put_total(json["queues"], queue.name, queue.dropped);
  json["estimator"] = totals_json({{"unknown_senders", status.estimator.unknown_senders},
                                   {"refused_samples", status.estimator.refused_samples},
                                   {"ids_confirmed", status.estimator.predicted_ids.confirmed},
                                   {"ids_unconfirmed", status.estimator.predicted_ids.unconfirmed},
                                   {"foreign_boards", status.estimator.foreign_boards}});
  put_refused_imu(json["estimator"], status.estimator.refused_imu);
  json["mesh"] = mesh_json(status.mesh);
  json["network"] = totals_json(status.network);
}

/// Calls `change` for each entry of a list, if the list exists.
template <class Change>
void for_each_in(Json& status, const char* list, const Change& change) {
  const auto found = status.find(list);
  if (found == status.end()) return;
  for (Json& entry : *found) change(entry);
}

void erase_in_each(Json& status, const char* list, const char* key) {
  for_each_in(status, list, [&](Json& entry) { entry.erase(key); });
}

/// Reduces a clock to the content of a short STATUS: the offset, to a microsecond.
void shorten_clock(Json& clock) {
  clock.erase("skew_ppm");
  clock.erase("sigma_s");
  if (const auto offset = clock.find("offset_s"); offset != clock.end())
    *offset = std::round(offset->get<double>() * 1e6) / 1e6;
}

void shorten_message(Json& sensor) {
  if (const auto message = sensor.find("message"); message != sensor.end())
    *message = truncated_utf8(message->get<std::string>(), kShortText);
}

/// Removes the last entry, so that the list stays in order. False if it is empty or missing.
bool drop_last(Json& status, const char* list) {
  const auto found = status.find(list);
  if (found == status.end() || found->empty()) return false;
  found->erase(found->size() - 1);
  return true;
}

/// Neighbors that do not fit are listed by id; a few are always reported in full.
bool drop_last_neighbor(Json& status) {
  constexpr std::size_t kMinNeighbors = 3;
  const auto neighbors = status.find("neighbors");
  if (neighbors == status.end() || neighbors->size() <= kMinNeighbors) return false;
  Json more = status.value("more", Json::array());
  more.insert(more.begin(), neighbors->back()["peer"]);
  status["more"] = std::move(more);
  return drop_last(status, "neighbors");
}

/// The first faults of this robot remain; an empty list would claim that there are none.
bool drop_last_fault(Json& status) {
  if (!drop_last(status, "faults")) return false;
  if (status["faults"].empty()) status.erase("faults");
  return true;
}

/// A reduction of a STATUS.
using Cut = void (*)(Json&);

/// The text after reductions in order, the least important part first. Each applies only if the
/// rest is still too long.
std::string shortened(Json& status, std::span<const Cut> cuts) {
  std::string text = dump(status);
  for (const Cut cut : cuts) {
    if (text.size() <= kMaxSubscriptionDatagram) return text;
    status["truncated"] = true;
    cut(status);
    text = dump(status);
  }
  return text;
}

std::string fitted(Json status) {
  constexpr std::array<Cut, 16> kCuts{
      [](Json& s) { erase_in_each(s, "sensors", "counts"); },
      [](Json& s) { erase_in_each(s, "neighbors", "measurements"); },
      [](Json& s) { erase_in_each(s, "neighbors", "measured"); },
      [](Json& s) { s.erase("network"); },
      [](Json& s) { s.erase("mesh"); },
      [](Json& s) {
        erase_in_each(s, "neighbors", "id_decodes");
        erase_in_each(s, "neighbors", "refused_imu");
      },
      [](Json& s) { for_each_in(s, "clocks", shorten_clock); },
      [](Json& s) { s.erase("estimator"); },
      [](Json& s) { erase_in_each(s, "sensors", "faults"); },
      [](Json& s) { erase_in_each(s, "neighbors", "age_s"); },
      [](Json& s) { erase_in_each(s, "neighbors", "name"); },
      [](Json& s) { for_each_in(s, "sensors", shorten_message); },
      [](Json& s) { s.erase("queues"); },
      [](Json& s) { s.erase("config"); },
      [](Json& s) { s.erase("clocks"); },
      [](Json& s) { erase_in_each(s, "neighbors", "faults"); },
  };
  std::string text = shortened(status, kCuts);
  while (text.size() > kMaxSubscriptionDatagram) {
    if (!drop_last_neighbor(status) && !drop_last(status, "more") && !drop_last_fault(status) &&
        !drop_last(status, "sensors"))
      break;
    text = dump(status);
  }
  return text;
}

/// The robot's name, if it is a member.
std::optional<std::string> member_name(const SystemStatus& status, RobotId robot) {
  if (robot == status.self) return status.name;
  const auto& neighbors = status.estimator.neighbors;
  const auto neighbor = std::ranges::find(neighbors, robot, &NeighborStatus::neighbor);
  if (neighbor == neighbors.end()) return std::nullopt;
  return neighbor->name;
}

/// STATUS with those robots of the team that `wanted` accepts.
template <class Wanted>
Json team_part_json(const SystemStatus& status, TeamDetail detail, const Wanted& wanted) {
  Json json = head_json(status);
  Json& team = json["team"] = Json::object();
  if (!status.estimator.team) return json;
  put(team, "age_s", to_seconds(status.stamp - status.estimator.team->stamp), 3);
  team["robots"] = Json::array();
  for (const TeamRobotStatus& robot : status.estimator.team->robots) {
    const RobotId id = robot.calibration.robot;
    if (!wanted(id)) continue;
    const std::string name = member_name(status, id).value_or(std::string());
    team["robots"].push_back(team_robot_json(robot, name, status.self, detail));
  }
  return json;
}

}  // namespace

std::string status_json(const SystemStatus& status, StatusPart about) {
  Json json = head_json(status);
  put(json, "cpu_s", status.cpu_s, 5);
  put(json, "rss_mb", status.rss_mb, 4);
  json["config"] = config_json(status);
  put_faults(json, status.estimator.faults);
  if (about != StatusPart::kNetwork) put_sensors(json, status);
  if (about == StatusPart::kAll) {
    json["neighbors"] = Json::array();
    for (const NeighborStatus& neighbor : status.estimator.neighbors)
      json["neighbors"].push_back(neighbor_json(neighbor));
    json["clocks"] = Json::array();
    for (const ClockStatus& clock : status.clocks) json["clocks"].push_back(clock_json(clock));
  }
  if (about != StatusPart::kSensors) put_network(json, status);
  return fitted(std::move(json));
}

std::optional<std::string> peer_status_json(const SystemStatus& status, RobotId peer) {
  const auto& neighbors = status.estimator.neighbors;
  const auto neighbor = std::ranges::find(neighbors, peer, &NeighborStatus::neighbor);
  if (neighbor == neighbors.end()) return std::nullopt;
  Json json = head_json(status);
  put(json, "timestamp", to_seconds(status.stamp.time_since_epoch()), 13);
  json["neighbors"] = Json::array({neighbor_json(*neighbor)});
  json["neighbors"][0]["ages_s"] = ages_json(*neighbor, status.stamp);
  if (Json measured = measured_json(*neighbor); !measured.empty())
    json["neighbors"][0]["measured"] = std::move(measured);
  const auto traffic = std::ranges::find(status.traffic, peer, &PeerTraffic::peer);
  if (traffic != status.traffic.end()) json["neighbors"][0]["reports"] = traffic_json(*traffic);
  const auto air = status.mesh.air.of_peers.find(peer);
  if (air != status.mesh.air.of_peers.end()) put(json["neighbors"][0], "airtime", air->second, 3);
  if (neighbor->range_residual_m)
    put(json["neighbors"][0], "range_residual_m", *neighbor->range_residual_m, 3);
  json["clocks"] = Json::array();
  const auto clock = std::ranges::find(status.clocks, peer, &ClockStatus::peer);
  if (clock != status.clocks.end()) json["clocks"].push_back(clock_json(*clock));
  return fitted(std::move(json));
}

std::optional<std::string> sensor_status_json(const SystemStatus& status, std::string_view sensor) {
  const auto is_meant = [sensor](const SensorStatus& one) {
    return truncated_utf8(one.name, kMaxName) == sensor;
  };
  const auto found = std::ranges::find_if(status.sensors, is_meant);
  if (found == status.sensors.end()) return std::nullopt;
  Json json = head_json(status);
  json["sensors"] = Json::array({sensor_json(*found)});
  return fitted(std::move(json));
}

std::string team_status_json(const SystemStatus& status) {
  Json json = team_part_json(status, TeamDetail::kBrief, [](RobotId) { return true; });
  std::string text = dump(json);
  Json more = Json::array();
  while (text.size() > kMaxSubscriptionDatagram && !json["team"]["robots"].empty()) {
    more.insert(more.begin(), json["team"]["robots"].back()["robot"]);
    drop_last(json["team"], "robots");
    json["more"] = more;
    json["truncated"] = true;
    text = dump(json);
  }
  return text;
}

std::optional<std::string> team_status_json(const SystemStatus& status, RobotId robot) {
  if (!member_name(status, robot)) return std::nullopt;
  Json json =
      team_part_json(status, TeamDetail::kFull, [robot](RobotId id) { return id == robot; });
  std::string text = dump(json);
  if (text.size() > kMaxSubscriptionDatagram) {  // two cameras, and a fault
    json["truncated"] = true;
    erase_in_each(json["team"]["robots"][0]["calibration"], "cameras", "lens_mrad");
    text = dump(json);
  }
  while (text.size() > kMaxSubscriptionDatagram) {  // four cameras, or several faults
    Json& only = json["team"]["robots"][0];
    if (only["calibration"].erase("gyro_scale") == 0 && !drop_last(only["calibration"], "cameras"))
      only.erase("faults");
    text = dump(json);
  }
  return text;
}

std::optional<std::string> pair_status_json(const SystemStatus& status, RobotId peer) {
  const auto& neighbors = status.estimator.neighbors;
  const auto neighbor = std::ranges::find(neighbors, peer, &NeighborStatus::neighbor);
  if (neighbor == neighbors.end()) return std::nullopt;
  Json json = head_json(status);
  json["pair"] = pair_filter_json(*neighbor);
  constexpr std::array<Cut, 3> kCuts{
      [](Json& s) {
        s.erase("name");
        s["pair"].erase("name");
      },
      [](Json& s) { s["pair"].erase("residuals"); },
      [](Json& s) { s["pair"].erase("calibration"); },
  };
  return shortened(json, kCuts);
}

}  // namespace crepes
