#include "daemon/ctl/view/site.hpp"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "daemon/ctl/live/pose_advice.hpp"
#include "daemon/ctl/view/camera_control.hpp"
#include "daemon/ctl/view/listen_address.hpp"
#include "daemon/ctl/view/page_files.hpp"
#include "daemon/ctl/view/view_json.hpp"
#include "daemon/version.hpp"
#include "drivers/base/number_text.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kForbidden = 403;
constexpr int kNotFound = 404;
constexpr int kBroken = 500;
constexpr const char* kJson = "application/json";
constexpr const char* kStream = "text/event-stream";
// A reader that is gone is noticed when something is written to it.
constexpr Duration kHeartbeat = std::chrono::seconds{5};

HttpReply not_found() { return {.status = kNotFound, .body = "no such page\n"}; }

/// "robot=3&camera=0", by name.
std::map<std::string, std::string> parameters_of(const std::string& query) {
  std::map<std::string, std::string> parameters;
  std::istringstream parts(query);
  for (std::string part; std::getline(parts, part, '&');) {
    const std::size_t equal = std::min(part.find('='), part.size());
    parameters[part.substr(0, equal)] = part.substr(std::min(equal + 1, part.size()));
  }
  return parameters;
}

/// A number below `count`; empty for anything else.
std::optional<std::size_t> index_in(const std::map<std::string, std::string>& parameters,
                                    const char* name, std::size_t count) {
  const auto found = parameters.find(name);
  std::size_t index = 0;
  if (found == parameters.end() || !parse_number(found->second, index).empty() || index >= count)
    return std::nullopt;
  return index;
}

/// What to do where there is no pose, by reason.
Json advice_json() {
  Json advice = Json::object();
  for (int i = 1; i <= static_cast<int>(NoPoseReason::kUncertain); ++i) {
    const auto reason = static_cast<NoPoseReason>(i);
    advice[std::string(name_of(reason))] = advice_for(reason);
  }
  return {{"advice", std::move(advice)}};
}

HttpReply reply_to(const Result<void>& done) {
  if (done) return {.body = "done\n"};
  return {.status = done.error().code == ErrorCode::kUsage ? kForbidden : kBroken,
          .body = done.error().message + "\n"};
}

}  // namespace

Access Site::access_to(const std::string& path) {
  if (path == "/light") return Access::kAction;
  const bool is_data =
      path == "/robots" || path == "/events" || path == "/replay" || path == "/camera";
  return is_data ? Access::kData : Access::kFile;
}

std::size_t Site::camera_topic(std::size_t robot, std::size_t camera) const {
  return robot_count() * (1 + camera) + robot;
}

std::size_t Site::robot_count() const {
  const auto* live = std::get_if<Live>(&source_);
  return live != nullptr ? live->size() : std::get<RecordedFeed>(source_).observers().size();
}

std::string Site::robots_json(Json json) const {
  json.update({{"release", kVersion}, {"live", std::holds_alternative<Live>(source_)}});
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
  if (request.path == "/robots") return {.type = kJson, .body = robots_json(advice_json())};
  const auto parameters = parameters_of(request.query);
  const auto robot = index_in(parameters, "robot", robot_count());
  if (!robot) return not_found();
  if (std::holds_alternative<Live>(source_))
    return live_answer(request.path, *robot, parameters, now);
  if (request.path == "/replay") {
    const auto& recorded = std::get<RecordedFeed>(source_);
    const auto json = recorded.json_of(recorded.observers()[*robot]);
    return json ? HttpReply{.type = kJson, .body = *json}
                : HttpReply{.status = kBroken, .body = json.error().message + "\n"};
  }
  return not_found();
}

HttpReply Site::live_answer(const std::string& path, std::size_t robot,
                            const Parameters& parameters, Timestamp now) const {
  if (path == "/events") {
    const LiveMessages& messages = std::get<Live>(source_)[robot].messages();
    return {.type = kStream,
            .body = stream_event("robots", robots_json(Json::object())) + messages.greeting(now),
            .topic = robot};
  }
  const auto camera = index_in(parameters, "camera", CameraFeed::kMaxCameras);
  if (!camera) return not_found();
  if (path == "/camera") {
    return {
        .type = kStream, .body = cameras_[robot].greeting(), .topic = camera_topic(robot, *camera)};
  }
  if (path == "/light" && robot == 0)
    return reply_to(change_camera(cameras_.front(), config_, *camera, parameters));
  return not_found();
}

void Site::advance_cameras(HttpServer& server, Timestamp now) {
  const Live& live = std::get<Live>(source_);
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    std::vector<std::uint8_t> wanted;
    for (std::uint8_t camera = 0; camera < CameraFeed::kMaxCameras; ++camera)
      if (server.readers(camera_topic(i, camera)) > 0) wanted.push_back(camera);
    for (const auto& [camera, events] :
         cameras_[i].exchange(now, wanted, live[i].messages().poses()))
      server.publish(camera_topic(i, camera), events);
  }
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
  advance_cameras(server, now);
  std::string common;
  if (std::string robots = robots_json(Json::object()); robots != sent_robots_) {
    common += stream_event("robots", robots);
    sent_robots_ = std::move(robots);
  }
  if (now >= next_heartbeat_) {
    common += ": still here\n\n";
    next_heartbeat_ = now + kHeartbeat;
  }
  if (common.empty()) return;
  for (std::size_t i = 0; i < live->size() * (1 + CameraFeed::kMaxCameras); ++i)
    server.publish(i, common);
}

}  // namespace crepes
