#include <charconv>
#include <limits>
#include <nlohmann/json.hpp>

#include "net/client/client.hpp"

namespace crepes::client {
namespace {

using nlohmann::json;

[[noreturn]] void refuse(const std::string& why) {
  throw json::other_error::create(0, why, nullptr);
}

std::uint16_t id_from(const json& value) {
  const auto id = value.get<std::int64_t>();
  if (id < 0 || id > std::numeric_limits<std::uint16_t>::max()) refuse("no robot has this id");
  return static_cast<std::uint16_t>(id);
}

/// Numbers of 64 bits are strings, because JSON has doubles.
std::int64_t int64_from(const json& value) {
  const std::string text = value.get<std::string>();
  std::int64_t number = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (fault != std::errc() || end != text.data() + text.size()) refuse("not a number: " + text);
  return number;
}

Mode mode_from(const std::string& name) {
  for (const Mode mode : {Mode::kDirect, Mode::kGraph})
    if (name == name_of(mode)) return mode;
  return Mode::kPredicted;
}

Vector vector_from(const json& value) {
  return {value.at("x").get<double>(), value.at("y").get<double>(), value.at("z").get<double>()};
}

std::optional<Vector> vector_in(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return std::nullopt;
  return vector_from(*found);
}

Quaternion quaternion_from(const json& value) {
  const Vector xyz = vector_from(value);
  return {value.at("w").get<double>(), xyz.x, xyz.y, xyz.z};
}

Pose pose_from(const json& object) {
  Pose pose;
  pose.t_ns = int64_from(object.at("t_ns"));
  pose.self = id_from(object.at("self"));
  pose.peer = id_from(object.at("peer"));
  pose.name = object.value("name", "");
  pose.mode = mode_from(object.value("mode", ""));
  pose.position = vector_from(object.at("position"));
  pose.orientation = quaternion_from(object.at("orientation"));
  pose.velocity = vector_in(object, "velocity");
  pose.up = vector_in(object, "up");
  if (const auto found = object.find("covariance"); found != object.end()) {
    if (found->size() != 21) refuse("a covariance has 21 numbers");
    pose.covariance = found->get<std::array<double, 21>>();
  }
  pose.seq = object.value("seq", std::uint64_t{0});
  if (object.contains("t_pub_ns")) pose.t_pub_ns = int64_from(object["t_pub_ns"]);
  pose.age_s = object.value("age_s", 0.0);
  pose.reset_counter = object.value("reset_counter", std::uint32_t{0});
  pose.sources = object.value("sources", pose.sources);
  return pose;
}

/// The numbers under `key`; what else may stand beside them is of no concern here.
Status::Totals totals_from(const json& object, const char* key) {
  const json entries = object.value(key, json::object());
  Status::Totals totals;
  for (const auto& [name, value] : entries.items()) {
    if (value.is_number_unsigned()) totals.emplace(name, value.get<std::uint64_t>());
  }
  return totals;
}

Status::Reports reports_from(const json& object) {
  Status::Reports reports;
  reports.received = object.value("received", reports.received);
  reports.lost = object.value("lost", reports.lost);
  reports.restarts = object.value("restarts", reports.restarts);
  reports.age_s = object.value("age_s", reports.age_s);
  reports.loss = object.value("loss", reports.loss);
  return reports;
}

Status::Neighbor neighbor_from(const json& object) {
  Status::Neighbor neighbor;
  neighbor.peer = id_from(object.at("peer"));
  neighbor.name = object.value("name", "");
  neighbor.state = object.value("state", neighbor.state);
  neighbor.reason = object.value("reason", "");
  neighbor.faults = object.value("faults", neighbor.faults);
  neighbor.measurements = object.value("measurements", neighbor.measurements);
  neighbor.ages_s = object.value("ages_s", neighbor.ages_s);
  if (const auto found = object.find("reports"); found != object.end())
    neighbor.reports = reports_from(*found);
  return neighbor;
}

Status::Sensor sensor_from(const json& object) {
  return {object.at("name").get<std::string>(),
          object.value("rate_hz", 0.0),
          object.value("ok", false),
          object.value("message", ""),
          totals_from(object, "faults"),
          totals_from(object, "counts"),
          object.value("calibrated", true)};
}

std::optional<double> number_in(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return std::nullopt;
  return found->get<double>();
}

Status::Clock clock_from(const json& object) {
  return {id_from(object.at("peer")), object.value("offset_s", 0.0), number_in(object, "skew_ppm"),
          number_in(object, "sigma_s")};
}

Status::Mesh mesh_from(const json& object) {
  return {object.value("sealed", false), object.value("signed", false), object.value("warning", ""),
          object.value("airtime", 0.0), object.value("airtime_of_all", 0.0)};
}

/// Calls `read` for each entry of a list; a missing list has none.
template <class Read>
void for_each_of(const json& object, const char* list, const Read& read) {
  const auto found = object.find(list);
  if (found == object.end()) return;
  for (const json& entry : *found) read(entry);
}

Status::Estimate estimate_from(const json& object) {
  const auto numbers = [](const json& value) {
    return value.is_array() ? value.get<std::vector<double>>()
                            : std::vector<double>{value.get<double>()};
  };
  return {numbers(object.at("value")), numbers(object.at("sigma"))};
}

/// Those entries of an object that are estimates.
std::map<std::string, Status::Estimate> estimates_in(const json& object) {
  std::map<std::string, Status::Estimate> estimates;
  for (const auto& [key, value] : object.items())
    if (value.is_object() && value.contains("sigma")) estimates[key] = estimate_from(value);
  return estimates;
}

std::map<std::string, Status::Residual> residuals_from(const json& object) {
  std::map<std::string, Status::Residual> residuals;
  const auto found = object.find("residuals");
  if (found == object.end()) return residuals;
  for (const auto& [kind, value] : found->items()) {
    Status::Residual& residual = residuals[kind];
    residual.nis = number_in(value, "nis");
    residual.fused = value.value("fused", residual.fused);
    residual.refused = value.value("refused", residual.refused);
  }
  return residuals;
}

Status::TeamRobot team_robot_from(const json& object) {
  Status::TeamRobot robot;
  robot.robot = id_from(object.at("robot"));
  robot.name = object.value("name", "");
  robot.trusted = object.value("trusted", false);
  robot.nis = object.value("nis", robot.nis);
  robot.residuals = residuals_from(object);
  robot.faults = object.value("faults", robot.faults);
  const auto calibration = object.find("calibration");
  if (calibration == object.end()) return robot;
  robot.calibration = estimates_in(*calibration);
  for_each_of(*calibration, "cameras", [&](const json& camera) {
    robot.cameras.push_back({camera.value("p_body_camera", std::vector<double>()),
                             camera.value("state", ""), estimates_in(camera)});
  });
  return robot;
}

Status::Team team_from(const json& object) {
  Status::Team team;
  team.age_s = number_in(object, "age_s");
  for_each_of(object, "robots",
              [&](const json& robot) { team.robots.push_back(team_robot_from(robot)); });
  return team;
}

Status::Pair pair_from(const json& object) {
  Status::Pair pair;
  pair.peer = id_from(object.at("peer"));
  pair.name = object.value("name", "");
  pair.residuals = residuals_from(object);
  if (const auto found = object.find("calibration"); found != object.end())
    pair.calibration = estimates_in(*found);
  return pair;
}

Status status_from(const json& object) {
  Status status;
  status.self = id_from(object.at("self"));
  status.name = object.value("name", "");
  status.uptime_s = object.value("uptime_s", 0.0);
  status.faults = object.value("faults", status.faults);
  status.cpu_s = object.value("cpu_s", 0.0);
  status.rss_mb = object.value("rss_mb", 0.0);
  for_each_of(object, "neighbors",
              [&](const json& entry) { status.neighbors.push_back(neighbor_from(entry)); });
  for_each_of(object, "more", [&](const json& id) {
    status.neighbors.emplace_back();
    status.neighbors.back().peer = id_from(id);
  });
  for_each_of(object, "sensors",
              [&](const json& entry) { status.sensors.push_back(sensor_from(entry)); });
  for_each_of(object, "clocks",
              [&](const json& entry) { status.clocks.push_back(clock_from(entry)); });
  status.queues = totals_from(object, "queues");
  status.network = totals_from(object, "network");
  status.estimator = totals_from(object, "estimator");
  status.refused_imu = totals_from(object.value("estimator", json::object()), "refused_imu");
  if (const auto mesh = object.find("mesh"); mesh != object.end()) status.mesh = mesh_from(*mesh);
  if (const auto team = object.find("team"); team != object.end()) status.team = team_from(*team);
  if (const auto pair = object.find("pair"); pair != object.end()) status.pair = pair_from(*pair);
  status.is_truncated = object.value("truncated", false);
  return status;
}

Version version_from(const json& object) {
  return {object.value("release", ""), object.value("proto_major", 0),
          object.value("proto_minor", 0), object.value("lease_s", 0.0)};
}

std::optional<Message> message_from(const json& object) {
  const auto name = object.at("class").get<std::string>();
  if (name == "POSE") return pose_from(object);
  if (name == "STATUS") return status_from(object);
  if (name == "VERSION") return version_from(object);
  if (name == "ERROR") return Error{object.value("message", "")};
  return std::nullopt;
}

}  // namespace

std::string_view name_of(Mode mode) {
  switch (mode) {
    case Mode::kDirect:
      return "direct";
    case Mode::kGraph:
      return "graph";
    case Mode::kPredicted:
      break;
  }
  return "predicted";
}

std::array<std::array<double, 6>, 6> matrix_of(const std::array<double, 21>& covariance) {
  std::array<std::array<double, 6>, 6> P{};
  std::size_t next = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) P[i][j] = P[j][i] = covariance[next++];
  }
  return P;
}

std::optional<Message> parse(std::string_view datagram) {
  try {
    return message_from(json::parse(datagram));
  } catch (const json::exception&) {  // not of this protocol
    return std::nullopt;
  }
}

}  // namespace crepes::client
