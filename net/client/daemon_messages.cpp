#include <nlohmann/json.hpp>

#include "drivers/base/number_text.hpp"
#include "net/client/daemon_client.hpp"

namespace crepes {
namespace {

using ParsedJson = nlohmann::json;

RobotId id_from(const ParsedJson& json) { return RobotId{json.get<std::uint16_t>()}; }

PoseMode mode_from(const std::string& name) {
  for (const PoseMode mode : {PoseMode::kDirect, PoseMode::kGraph})
    if (name == name_of(mode)) return mode;
  return PoseMode::kPredicted;
}

Eigen::Vector3d vector_from(const ParsedJson& json) {
  return {json.at("x").get<double>(), json.at("y").get<double>(), json.at("z").get<double>()};
}

Matrix6d covariance_from(const ParsedJson& json) {
  Matrix6d P;
  std::size_t next = 0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index j = i; j < 6; ++j) P(i, j) = P(j, i) = json.at(next++).get<double>();
  }
  return P;
}

PoseMessage pose_from(const ParsedJson& json) {
  PoseMessage message;
  message.self = id_from(json.at("self"));
  message.name = json.value("name", "");
  NeighborPose& pose = message.pose;
  pose.neighbor = id_from(json.at("peer"));
  std::int64_t t_ns = 0;
  if (!parse_number(json.at("t_ns").get<std::string>(), t_ns).empty())
    throw nlohmann::json::other_error::create(0, "t_ns is not a number", nullptr);
  pose.stamp = Timestamp{Duration{t_ns}};
  pose.mode = mode_from(json.value("mode", ""));
  pose.T_B_N.pose.p = vector_from(json.at("position"));
  const Eigen::Vector3d xyz = vector_from(json.at("orientation"));
  const double w = json.at("orientation").at("w").get<double>();
  pose.T_B_N.pose.q = Eigen::Quaterniond(w, xyz.x(), xyz.y(), xyz.z()).normalized();
  if (json.contains("covariance")) pose.T_B_N.covariance = covariance_from(json["covariance"]);
  if (json.contains("velocity")) pose.v_B_N = vector_from(json["velocity"]);
  if (json.contains("up")) pose.up_B = vector_from(json["up"]);
  pose.age_s = json.value("age_s", 0.0);
  pose.reset_counter = json.value("reset_counter", 0U);
  return message;
}

StatusMessage::Totals totals_from(const ParsedJson& json, const char* key) {
  return json.value(key, StatusMessage::Totals());
}

StatusMessage::Neighbor neighbor_from(const ParsedJson& json) {
  StatusMessage::Neighbor neighbor{.neighbor = id_from(json.at("peer")),
                                   .name = json.value("name", ""),
                                   .state = json.value("state", "none"),
                                   .reason = json.value("reason", ""),
                                   .measurements = {},
                                   .ages_s = {},
                                   .reports = {},
                                   .faults = json.value("faults", std::vector<std::string>())};
  const ParsedJson measurements = json.value("measurements", ParsedJson::object());
  for (const auto& [kind, verdicts] : measurements.items())
    neighbor.measurements[kind] = verdicts.get<StatusMessage::Totals>();
  neighbor.ages_s = json.value("ages_s", neighbor.ages_s);
  if (const auto reports = json.find("reports"); reports != json.end()) {
    neighbor.reports = {.received = reports->value("received", std::uint64_t{0}),
                        .lost = reports->value("lost", std::uint64_t{0}),
                        .restarts = reports->value("restarts", std::uint64_t{0}),
                        .age_s = reports->value("age_s", 0.0),
                        .loss = reports->value("loss", 0.0)};
  }
  return neighbor;
}

StatusMessage status_from(const ParsedJson& json) {
  StatusMessage status;
  status.self = id_from(json.at("self"));
  status.name = json.value("name", "");
  status.uptime_s = json.value("uptime_s", 0.0);
  status.faults = json.value("faults", status.faults);
  status.cpu_s = json.value("cpu_s", 0.0);
  status.rss_mb = json.value("rss_mb", 0.0);
  for (const ParsedJson& neighbor : json.value("neighbors", ParsedJson::array()))
    status.neighbors.push_back(neighbor_from(neighbor));
  for (const ParsedJson& id : json.value("more", ParsedJson::array()))
    status.neighbors.push_back(neighbor_from({{"peer", id}}));
  for (const ParsedJson& sensor : json.value("sensors", ParsedJson::array())) {
    status.sensors.push_back({.name = sensor.at("name").get<std::string>(),
                              .rate_hz = sensor.value("rate_hz", 0.0),
                              .ok = sensor.value("ok", false),
                              .message = sensor.value("message", ""),
                              .faults = totals_from(sensor, "faults"),
                              .counts = totals_from(sensor, "counts")});
  }
  for (const ParsedJson& clock : json.value("clocks", ParsedJson::array())) {
    status.clocks.push_back({.peer = id_from(clock.at("peer")),
                             .offset_s = clock.value("offset_s", 0.0),
                             .skew_ppm = clock.value("skew_ppm", 0.0),
                             .sigma_s = clock.value("sigma_s", 0.0)});
  }
  status.queues = totals_from(json, "queues");
  status.network = totals_from(json, "network");
  if (const auto mesh = json.find("mesh"); mesh != json.end()) {
    status.mesh = {.sealed = mesh->value("sealed", false),
                   .signs = mesh->value("signed", false),
                   .warning = mesh->value("warning", ""),
                   .airtime = mesh->value("airtime", 0.0),
                   .airtime_of_all = mesh->value("airtime_of_all", 0.0)};
  }
  return status;
}

DaemonMessage message_from(const ParsedJson& json) {
  const std::string name = json.at("class").get<std::string>();
  if (name == "POSE") return pose_from(json);
  if (name == "STATUS") return status_from(json);
  if (name == "VERSION")
    return VersionMessage{json.value("release", ""), json.value("lease_s", 0.0)};
  if (name == "COOKIE") return CookieMessage{json.at("cookie").get<std::string>()};
  if (name == "ERROR") return ErrorMessage{json.value("message", "")};
  throw nlohmann::json::other_error::create(0, "unknown class " + name, nullptr);
}

}  // namespace

Result<DaemonMessage> parse_message(std::string_view datagram) {
  try {
    return message_from(ParsedJson::parse(datagram));
  } catch (const ParsedJson::exception& e) {
    return fail(ErrorCode::kFormat, e.what());
  }
}

}  // namespace crepes
