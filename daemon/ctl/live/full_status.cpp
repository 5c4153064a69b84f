#include "daemon/ctl/live/full_status.hpp"

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "drivers/base/monotonic_clock.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr Duration kPatience = std::chrono::seconds{3};  ///< a datagram may get lost
constexpr std::chrono::milliseconds kStep{100};

/// The first answer to `question` that satisfies `wanted`; empty without one.
Result<std::optional<Json>> ask(client::Connection& daemon, const client::Poll& question,
                                const std::function<bool(const Json&)>& wanted) {
  daemon.ask({.watch = false, .polls = {question}});
  const MonotonicClock clock;
  const Timestamp end = clock.now() + kPatience;
  while (clock.now() < end) {
    const auto answer = daemon.receive(kStep);
    if (!answer) continue;
    if (const auto* refusal = std::get_if<client::Error>(&answer->message))
      return fail(ErrorCode::kIo, "daemon: " + refusal->message);
    Json json = Json::parse(answer->text, nullptr, /*allow_exceptions=*/false);
    if (std::holds_alternative<client::Status>(answer->message) && wanted(json)) return json;
  }
  return std::nullopt;
}

void replace(Json& whole, const Json& part, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (part.contains(key)) whole[key] = part[key];
}

/// Requests the full status of every neighbor in the short STATUS.
Result<void> ask_neighbors(client::Connection& daemon, Json& whole) {
  Json ids = Json::array();
  for (const Json& neighbor : whole["neighbors"]) ids.push_back(neighbor["peer"]);
  for (const Json& id : whole.value("more", Json::array())) ids.push_back(id);
  Json neighbors = Json::array();
  Json clocks = Json::array();
  for (const Json& id : ids) {
    auto part = ask(daemon, {.peer = id.get<std::uint16_t>()}, [&](const Json& json) {
      return !json.contains("sensors") && json.contains("neighbors") &&
             json["neighbors"].size() == 1 && json["neighbors"][0]["peer"] == id;
    });
    if (!part) return tl::unexpected(part.error());
    if (!*part) continue;
    neighbors.push_back((**part)["neighbors"][0]);
    for (const Json& clock : (**part)["clocks"]) clocks.push_back(clock);
  }
  whole["neighbors"] = std::move(neighbors);
  whole["clocks"] = std::move(clocks);
  return {};
}

/// Returns whether all of the part has come.
Result<bool> ask_part(client::Connection& daemon, const std::string& part, Json& whole) {
  auto answer = ask(daemon, {.about = part}, [&](const Json& json) {
    return json.contains(part) && !json.contains("neighbors");
  });
  if (!answer) return tl::unexpected(answer.error());
  if (!*answer) return false;
  replace(whole, **answer,
          {"config", "faults", "sensors", "queues", "estimator", "mesh", "network"});
  return !(**answer).value("truncated", false);
}

/// Sensor by sensor, where one datagram has no room for the counts of all. What a daemon does not
/// answer, as one of an older version, stays unknown.
void ask_sensors(client::Connection& daemon, Json& whole) {
  for (Json& sensor : whole["sensors"]) {
    if (sensor.contains("counts")) continue;
    const Json name = sensor["name"];
    const auto part =
        ask(daemon, {.about = "sensors", .sensor = name.get<std::string>()}, [&](const Json& json) {
          return json.contains("sensors") && !json.contains("neighbors") &&
                 json["sensors"].size() == 1 && json["sensors"][0]["name"] == name;
        });
    if (!part || !*part) return;
    sensor = (**part)["sensors"][0];
  }
}

/// Of every robot that the team's filter estimates, in full. A daemon of an older version refuses.
void ask_team(client::Connection& daemon, Json& whole) {
  const auto has_team = [](const Json& json) { return json.contains("team"); };
  const auto brief = ask(daemon, {.about = "team"}, has_team);
  if (!brief || !*brief) return;
  Json ids = Json::array();
  for (const Json& robot : (**brief)["team"].value("robots", Json::array()))
    ids.push_back(robot["robot"]);
  for (const Json& id : (**brief).value("more", Json::array())) ids.push_back(id);
  whole["team"] = (**brief)["team"];
  whole["team"]["robots"] = Json::array();
  for (const Json& id : ids) {
    const auto part =
        ask(daemon, {.peer = id.get<std::uint16_t>(), .about = "team"}, [&](const Json& json) {
          return json.contains("team") && json["team"].contains("robots") &&
                 json["team"]["robots"].size() == 1 && json["team"]["robots"][0]["robot"] == id &&
                 json["team"]["robots"][0].contains("calibration");
        });
    if (part && *part) whole["team"]["robots"].push_back((**part)["team"]["robots"][0]);
  }
}

Result<Json> ask_all(client::Connection& daemon, const DaemonAddress& address) {
  auto brief = ask(daemon, {}, [](const Json& json) {
    return json.contains("neighbors") && json.contains("sensors");
  });
  if (!brief) return tl::unexpected(brief.error());
  if (!*brief) return tl::unexpected(no_answer_from(address, daemon.send_fault()));
  Json whole = std::move(**brief);
  const Result<bool> has_sensors = ask_part(daemon, "sensors", whole);
  if (!has_sensors) return tl::unexpected(has_sensors.error());
  if (!*has_sensors) ask_sensors(daemon, whole);
  if (const auto done = ask_part(daemon, "network", whole); !done)
    return tl::unexpected(done.error());
  if (const auto done = ask_neighbors(daemon, whole); !done) return tl::unexpected(done.error());
  ask_team(daemon, whole);
  whole.erase("truncated");
  whole.erase("more");
  return whole;
}

}  // namespace

Result<FullStatus> request_full_status(const DaemonAddress& address) try {
  Result<client::Connection> daemon = connect(address, {.watch = false});
  if (!daemon) return tl::unexpected(daemon.error());
  const Result<Json> whole = ask_all(*daemon, address);
  if (!whole) return tl::unexpected(whole.error());
  const std::string text = dump(*whole);
  const std::optional<client::Message> message = client::parse(text);
  const auto* status = message ? std::get_if<client::Status>(&*message) : nullptr;
  if (status == nullptr) return fail(ErrorCode::kFormat, "a STATUS that makes no sense");
  return FullStatus{text, *status};
} catch (const Json::exception& e) {  // a daemon of another version
  return fail(ErrorCode::kFormat, std::string("a STATUS that makes no sense: ") + e.what());
}

}  // namespace crepes
