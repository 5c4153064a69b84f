#include "daemon/ctl/view/site.hpp"

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/ctl/view/listen_address.hpp"
#include "daemon/ctl/view/page_files.hpp"
#include "daemon/ctl/view/view_json.hpp"
#include "daemon/version.hpp"
#include "drivers/base/number_text.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kNotFound = 404;
constexpr int kBroken = 500;
constexpr const char* kJson = "application/json";
// A reader that is gone is noticed when something is written to it.
constexpr Duration kHeartbeat = std::chrono::seconds{5};

HttpReply not_found() { return {.status = kNotFound, .body = "no such page\n"}; }

/// The number in "robot=3"; empty for anything else.
std::optional<std::size_t> robot_in(const std::string& query, std::size_t count) {
  constexpr std::string_view kKey = "robot=";
  std::size_t robot = 0;
  if (!query.starts_with(kKey) || !parse_number(query.substr(kKey.size()), robot).empty() ||
      robot >= count)
    return std::nullopt;
  return robot;
}

}  // namespace

bool Site::is_data(const std::string& path) {
  return path == "/robots" || path == "/events" || path == "/replay";
}

std::size_t Site::robot_count() const {
  const auto* live = std::get_if<Live>(&source_);
  return live != nullptr ? live->size() : std::get<RecordedFeed>(source_).observers().size();
}

std::string Site::robots_json() const {
  Json json{{"release", kVersion}, {"live", std::holds_alternative<Live>(source_)}};
  json["robots"] = Json::array();
  if (const auto* live = std::get_if<Live>(&source_)) {
    for (std::size_t i = 0; i < live->size(); ++i) {
      Json robot{{"place", authority_of(daemons_[i].address, daemons_[i].port)}};
      if (const auto& known = (*live)[i].messages().robot()) {
        robot["id"] = known->id.value;
        robot["name"] = known->name;
      }
      json["robots"].push_back(std::move(robot));
    }
  } else {
    for (const std::string& name : std::get<RecordedFeed>(source_).observers())
      json["robots"].push_back({{"name", name}});
  }
  return dump(json);
}

HttpReply Site::answer(const HttpRequest& request, Timestamp now) const {
  if (const PageFile* file = page_file(request.path))
    return {.type = std::string(file->type), .body = std::string(file->text)};
  if (request.path == "/robots") return {.type = kJson, .body = robots_json()};
  const auto robot = robot_in(request.query, robot_count());
  if (!robot) return not_found();
  const auto* live = std::get_if<Live>(&source_);
  if (request.path == "/events" && live != nullptr) {
    return {
        .type = "text/event-stream",
        .body = stream_event("robots", robots_json()) + (*live)[*robot].messages().greeting(now),
        .topic = *robot};
  }
  if (request.path == "/replay" && live == nullptr) {
    const auto& recorded = std::get<RecordedFeed>(source_);
    const auto json = recorded.json_of(recorded.observers()[*robot]);
    return json ? HttpReply{.type = kJson, .body = *json}
                : HttpReply{.status = kBroken, .body = json.error().message + "\n"};
  }
  return not_found();
}

void Site::advance(HttpServer& server, Timestamp now) {
  auto* live = std::get_if<Live>(&source_);
  if (live == nullptr) return;
  std::size_t readers = 0;
  for (std::size_t i = 0; i < live->size(); ++i) readers += server.readers(i);
  for (std::size_t i = 0; i < live->size(); ++i) {
    using Interest = LiveFeed::Interest;
    const bool is_read = server.readers(i) > 0;
    (*live)[i].exchange(now, is_read       ? Interest::kAll
                             : readers > 0 ? Interest::kName
                                           : Interest::kNone);
    const std::string events = (*live)[i].drain(now);
    if (is_read && !events.empty()) server.publish(i, events);
  }
  std::string common;
  if (std::string robots = robots_json(); robots != told_robots_) {
    common += stream_event("robots", robots);
    told_robots_ = std::move(robots);
  }
  if (now >= next_heartbeat_) {
    common += ": still here\n\n";
    next_heartbeat_ = now + kHeartbeat;
  }
  if (common.empty()) return;
  for (std::size_t i = 0; i < live->size(); ++i) server.publish(i, common);
}

}  // namespace crepes
