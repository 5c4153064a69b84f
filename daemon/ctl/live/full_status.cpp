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

constexpr int kAttempts = 3;  // a datagram may get lost
constexpr Duration kReplyTimeout = std::chrono::seconds{1};
constexpr std::chrono::milliseconds kStep{100};

/// Sends `question` and returns the first answer that satisfies `wanted`; empty without one.
Result<std::optional<Json>> ask(DaemonClient& client,
                                const std::function<Result<void>(DaemonClient&)>& question,
                                const std::function<bool(const Json&)>& wanted) {
  const MonotonicClock clock;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (auto sent = question(client); !sent) return tl::unexpected(sent.error());
    const Timestamp end = clock.now() + kReplyTimeout;
    while (clock.now() < end) {
      const auto answer = client.receive(kStep);
      if (!answer) return tl::unexpected(answer.error());
      if (!*answer) continue;
      if (const auto* refusal = std::get_if<ErrorMessage>(&(*answer)->message))
        return fail(ErrorCode::kIo, "daemon: " + refusal->message);
      Json json = Json::parse((*answer)->text, nullptr, /*allow_exceptions=*/false);
      if (std::holds_alternative<StatusMessage>((*answer)->message) && wanted(json)) return json;
    }
  }
  return std::nullopt;
}

void replace(Json& whole, const Json& part, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (part.contains(key)) whole[key] = part[key];
}

/// Requests the full status of every neighbor in the short STATUS.
Result<void> ask_neighbors(DaemonClient& client, Json& whole) {
  Json ids = Json::array();
  for (const Json& neighbor : whole["neighbors"]) ids.push_back(neighbor["peer"]);
  for (const Json& id : whole.value("more", Json::array())) ids.push_back(id);
  Json neighbors = Json::array();
  Json clocks = Json::array();
  for (const Json& id : ids) {
    const RobotId peer{id.get<std::uint16_t>()};
    auto part = ask(
        client, [&](DaemonClient& c) { return c.poll(peer); },
        [&](const Json& json) {
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

Result<void> ask_part(DaemonClient& client, std::string_view part, const char* mark, Json& whole) {
  auto answer = ask(
      client, [&](DaemonClient& c) { return c.poll(part); },
      [&](const Json& json) { return json.contains(mark) && !json.contains("neighbors"); });
  if (!answer) return tl::unexpected(answer.error());
  if (*answer) replace(whole, **answer, {"sensors", "queues", "estimator", "mesh", "network"});
  return {};
}

Result<Json> ask_all(DaemonClient& client, const DaemonAddress& daemon) {
  auto brief = ask(
      client, [](DaemonClient& c) { return c.poll(); },
      [](const Json& json) { return json.contains("neighbors") && json.contains("sensors"); });
  if (!brief) return tl::unexpected(brief.error());
  if (!*brief) return tl::unexpected(no_answer_from(daemon));
  Json whole = std::move(**brief);
  for (const auto& done :
       {ask_part(client, "sensors", "sensors", whole),
        ask_part(client, "network", "network", whole), ask_neighbors(client, whole)})
    if (!done) return tl::unexpected(done.error());
  whole.erase("truncated");
  whole.erase("more");
  return whole;
}

}  // namespace

Result<FullStatus> request_full_status(const DaemonAddress& daemon) try {
  Result<DaemonClient> client = DaemonClient::open(daemon);
  if (!client) return tl::unexpected(client.error());
  const Result<Json> whole = ask_all(*client, daemon);
  if (!whole) return tl::unexpected(whole.error());
  const std::string text = dump(*whole);
  return parse_message(text).map([&](DaemonMessage&& message) {
    return FullStatus{text, std::get<StatusMessage>(message)};
  });
} catch (const Json::exception& e) {  // a daemon of another version
  return fail(ErrorCode::kFormat, std::string("a STATUS that makes no sense: ") + e.what());
}

}  // namespace crepes
