#include "net/subscription_json.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMaxDepth = 8;
constexpr double kMinRate = 0.01;  // Hz
constexpr double kMaxRate = 1000.0;
constexpr std::size_t kMaxText = 160;  // bytes of a message
constexpr std::size_t kMaxName = 32;

/// Never throws: invalid UTF-8 is replaced.
std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// At most `limit` bytes of `text`, cut between characters.
std::string shortened(std::string_view text, std::size_t limit) {
  if (text.size() <= limit) return std::string(text);
  std::size_t end = limit;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return std::string(text.substr(0, end));
}

/// Rounded to so many digits, so that it prints short.
double rounded(double value, int digits) {
  if (value == 0.0 || !std::isfinite(value)) return value;
  const double exponent = std::floor(std::log10(std::abs(value)));
  const double scale = std::pow(10.0, digits - 1 - exponent);
  const double result = std::round(value * scale) / scale;
  return std::isfinite(result) ? result : value;
}

/// Unknown values are left out.
void put(Json& object, const char* key, double value, int digits = 7) {
  if (std::isfinite(value)) object[key] = rounded(value, digits);
}

void put_vector(Json& object, const char* key, const Eigen::Vector3d& v) {
  if (!v.allFinite()) return;
  object[key] = {{"x", rounded(v.x(), 7)}, {"y", rounded(v.y(), 7)}, {"z", rounded(v.z(), 7)}};
}

/// Brackets outside strings, before a parser that would build them all sees them.
bool is_nested_deeply(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string && c == '\\') {
      ++i;
    } else if (c == '"') {
      in_string = !in_string;
    } else if (!in_string && (c == '{' || c == '[')) {
      depth += 1;
    } else if (!in_string && (c == '}' || c == ']')) {
      depth -= 1;
    }
    if (depth > kMaxDepth) return true;
  }
  return false;
}

Result<std::vector<RobotId>> read_peers(const Json& json) {
  constexpr auto kReason = "\"peers\" must be a list of robot ids, 1 to 65534";
  if (!json.is_array()) return fail(ErrorCode::kFormat, kReason);
  std::vector<RobotId> peers;
  for (const Json& entry : json) {
    if (!entry.is_number_unsigned()) return fail(ErrorCode::kFormat, kReason);
    const auto id = entry.get<std::uint64_t>();
    if (id < 1 || id > 65534) return fail(ErrorCode::kFormat, kReason);
    peers.push_back(RobotId{static_cast<std::uint16_t>(id)});
  }
  return peers;
}

Result<SubscriptionRequest> read_watch(const Json& json) {
  WatchRequest watch;
  if (const auto enable = json.find("enable"); enable != json.end()) {
    if (!enable->is_boolean()) return fail(ErrorCode::kFormat, "\"enable\" must be true or false");
    watch.enable = enable->get<bool>();
  }
  if (const auto rate = json.find("rate_hz"); rate != json.end()) {
    const double rate_hz = rate->is_number() ? rate->get<double>() : 0.0;
    if (!(rate_hz >= kMinRate && rate_hz <= kMaxRate))
      return fail(ErrorCode::kFormat, "\"rate_hz\" must be a number from 0.01 to 1000");
    watch.rate_hz = rate_hz;
  }
  if (const auto peers = json.find("peers"); peers != json.end()) {
    auto ids = read_peers(*peers);
    if (!ids) return tl::unexpected(std::move(ids.error()));
    watch.peers = std::move(*ids);
  }
  return watch;
}

Json sources_of(const PoseSources& sources) {
  Json names = Json::array();
  if (sources.bearing) names.push_back("bearing");
  if (sources.peer_bearing) names.push_back("peer_bearing");
  if (sources.range) names.push_back("range");
  if (sources.imu) names.push_back("imu");
  if (sources.graph) names.push_back("graph");
  return names;
}

Json covariance_of(const Matrix6d& covariance) {
  Json entries = Json::array();
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column)
      entries.push_back(rounded(covariance(row, column), 6));
  }
  return entries;
}

Json sensor_json(const SensorStatus& sensor) {
  Json json{{"name", shortened(sensor.name, kMaxName)}};
  put(json, "rate_hz", sensor.rate_hz, 4);
  json["ok"] = sensor.ok;
  if (!sensor.message.empty()) json["message"] = shortened(sensor.message, kMaxText);
  for (const auto& [name, total] : sensor.counters)
    if (total > 0) json["faults"][shortened(name, kMaxName)] = total;
  return json;
}

Json neighbor_json(const NeighborStatus& neighbor) {
  Json json{{"peer", neighbor.neighbor.value}, {"name", shortened(neighbor.name, kMaxName)}};
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
  return json;
}

Json clock_json(const ClockStatus& clock) {
  Json json{{"peer", clock.peer.value}};
  put(json, "offset_s", clock.offset_s, 12);
  put(json, "skew_ppm", clock.skew_ppm, 4);
  put(json, "sigma_s", clock.sigma_s, 3);
  return json;
}

void erase_in_each(Json& list, std::string_view key) {
  for (Json& entry : list) entry.erase(std::string(key));
}

/// The least important parts first; each is dropped only if what is left is still too long.
std::string fitted(Json status) {
  using Cut = void (*)(Json&);
  constexpr std::array<Cut, 9> kCuts{
      [](Json& s) { erase_in_each(s["neighbors"], "measurements"); },
      [](Json& s) { erase_in_each(s["neighbors"], "id_decodes"); },
      [](Json& s) { s.erase("network"); },
      [](Json& s) { s.erase("estimator"); },
      [](Json& s) { erase_in_each(s["sensors"], "faults"); },
      [](Json& s) { erase_in_each(s["clocks"], "skew_ppm"); },
      [](Json& s) { erase_in_each(s["neighbors"], "name"); },
      [](Json& s) { s.erase("clocks"); },
      [](Json& s) { s.erase("queues"); },
  };
  std::string text = dump(status);
  for (const Cut cut : kCuts) {
    if (text.size() <= kMaxSubscriptionDatagram) return text;
    status["truncated"] = true;
    cut(status);
    text = dump(status);
  }
  while (text.size() > kMaxSubscriptionDatagram) {
    Json& neighbors = status["neighbors"];
    Json& longest = neighbors.size() >= status["sensors"].size() ? neighbors : status["sensors"];
    if (longest.empty()) break;
    longest.erase(longest.size() - 1);
    text = dump(status);
  }
  return text;
}

}  // namespace

Result<SubscriptionRequest> parse_request(std::string_view datagram) {
  if (datagram.size() > kMaxSubscriptionDatagram)
    return fail(ErrorCode::kFormat, "a request has at most 1200 bytes");
  if (is_nested_deeply(datagram)) return fail(ErrorCode::kFormat, "nested too deeply");
  const Json json = Json::parse(datagram, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) return fail(ErrorCode::kFormat, "not JSON");
  if (!json.is_object()) return fail(ErrorCode::kFormat, "a request is a JSON object");

  const auto name = json.find("class");
  if (name == json.end() || !name->is_string())
    return fail(ErrorCode::kFormat, "a request has a \"class\", WATCH or POLL");
  if (*name == "WATCH") return read_watch(json);
  if (*name == "POLL") return PollRequest{};
  return fail(ErrorCode::kFormat, "unknown class, use WATCH or POLL");
}

std::string version_json(std::string_view release, double lease_s) {
  return dump({{"class", "VERSION"},
               {"release", shortened(release, kMaxText)},
               {"proto_major", 1},
               {"proto_minor", 0},
               {"lease_s", lease_s}});
}

std::string pose_json(std::uint64_t sequence, RobotId self, std::string_view name,
                      const NeighborPose& pose) {
  Json json{{"class", "POSE"},
            {"seq", sequence},
            {"timestamp", to_seconds(pose.stamp.time_since_epoch())},
            {"t_ns", std::to_string(to_ns(pose.stamp))},
            {"self", self.value},
            {"peer", pose.neighbor.value},
            {"name", shortened(name, kMaxName)},
            {"mode", name_of(pose.mode)}};
  const Eigen::Quaterniond& q = pose.T_B_N.pose.q;
  put_vector(json, "position", pose.T_B_N.pose.p);
  if (q.coeffs().allFinite()) {
    json["orientation"] = {{"w", rounded(q.w(), 9)},
                           {"x", rounded(q.x(), 9)},
                           {"y", rounded(q.y(), 9)},
                           {"z", rounded(q.z(), 9)}};
  }
  put_vector(json, "velocity", pose.v_B_N);
  if (pose.T_B_N.covariance.allFinite()) json["covariance"] = covariance_of(pose.T_B_N.covariance);
  put(json, "age_s", pose.age_s, 4);
  json["reset_counter"] = pose.reset_counter;
  json["sources"] = sources_of(pose.sources);
  return dump(json);
}

std::string status_json(const SystemStatus& status) {
  Json json{
      {"class", "STATUS"}, {"self", status.self.value}, {"name", shortened(status.name, kMaxName)}};
  put(json, "uptime_s", status.uptime_s, 6);
  json["sensors"] = Json::array();
  for (const SensorStatus& sensor : status.sensors) json["sensors"].push_back(sensor_json(sensor));
  json["neighbors"] = Json::array();
  for (const NeighborStatus& neighbor : status.estimator.neighbors)
    json["neighbors"].push_back(neighbor_json(neighbor));
  json["clocks"] = Json::array();
  for (const ClockStatus& clock : status.clocks) json["clocks"].push_back(clock_json(clock));
  json["queues"] = Json::object();
  for (const QueueStatus& queue : status.queues)
    json["queues"][shortened(queue.name, kMaxName)] = queue.dropped;
  json["estimator"] = {{"unknown_senders", status.estimator.unknown_senders},
                       {"refused_samples", status.estimator.refused_samples}};
  json["network"] = Json::object();
  for (const auto& [name, total] : status.network)
    if (total > 0) json["network"][shortened(name, kMaxName)] = total;
  return fitted(std::move(json));
}

std::string error_json(std::string_view message) {
  return dump({{"class", "ERROR"}, {"message", shortened(message, kMaxText)}});
}

}  // namespace crepes
