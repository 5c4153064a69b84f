#include "daemon/ctl/view/live_messages.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "daemon/ctl/view/view_json.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

// STATUS is requested twice a second; the page must report a stopped daemon within two seconds.
constexpr Duration kMaxSilence = std::chrono::milliseconds{1500};

std::string frame_event(const std::map<RobotId, NeighborPose>& poses) {
  double newest_s = 0.0;
  std::string up;
  std::string rows;
  for (const auto& [id, pose] : poses) {
    const double t_s = to_seconds(pose.stamp.time_since_epoch());
    const std::string row = pose_row(t_s, pose);
    if (row.empty()) continue;
    if (t_s >= newest_s && pose.up_B) up = fmt::format(R"(,"up":{})", vector_row(*pose.up_B));
    newest_s = std::max(newest_s, t_s);
    rows += fmt::format(R"({}"{}":{})", rows.empty() ? "" : ",", id.value, row);
  }
  if (rows.empty()) return {};
  return stream_event("frame",
                      fmt::format(R"({{"t":{:.3f}{},"rows":{{{}}}}})", newest_s, up, rows));
}

/// A STATUS is about all, about a part, or about one neighbor.
std::string kind_of(const Json& status) {
  if (status.contains("team")) return "team";
  if (const auto pair = status.find("pair"); pair != status.end())
    return "pair " + dump(pair->value("peer", Json()));
  const bool has_sensors = status.contains("sensors");
  if (!status.contains("neighbors")) return has_sensors ? "sensors" : "network";
  const Json& neighbors = status["neighbors"];
  if (has_sensors || neighbors.size() != 1) return "all";
  return "neighbor " + dump(neighbors[0].value("peer", Json()));
}

}  // namespace

void LiveMessages::add(const client::Answer& answer, Timestamp now) {
  last_message_ = now;
  if (const auto* heard = std::get_if<client::Pose>(&answer.message)) {
    const NeighborPose pose = neighbor_pose_of(*heard);
    new_poses_[pose.neighbor] = pose;
    poses_.add(pose);
  } else if (const auto* status = std::get_if<client::Status>(&answer.message)) {
    add_status(*status, answer.text);
  }
}

/// Written anew, because a datagram may contain line ends, which would end the event.
void LiveMessages::add_status(const client::Status& status, const std::string& text) {
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) return;
  const std::string kind = kind_of(json);
  const std::string event = stream_event("status", dump(json));
  std::erase_if(statuses_, [&](const StatusEvent& each) { return each.kind == kind; });
  statuses_.push_back({kind, event});
  new_statuses_ += event;
  robot_ = ViewedRobot{RobotId{status.self}, status.name};
  if (kind != "all") return;
  neighbors_.clear();
  for (const auto& neighbor : status.neighbors) neighbors_.push_back(RobotId{neighbor.peer});
}

bool LiveMessages::is_silent(Timestamp now) const {
  return !last_message_ || now - *last_message_ > kMaxSilence;
}

std::string LiveMessages::link_event(bool is_silent) const {
  Json link{{"ok", !is_silent}};
  if (is_silent) link["reason"] = no_answer_from(daemon_).message;
  return stream_event("link", dump(link));
}

std::string LiveMessages::drain(Timestamp now) {
  std::string events;
  if (reported_silent_ != is_silent(now)) events += link_event(is_silent(now));
  reported_silent_ = is_silent(now);
  events += std::exchange(new_statuses_, {});
  return events + frame_event(std::exchange(new_poses_, {}));
}

std::string LiveMessages::greeting(Timestamp now) const {
  std::string events = link_event(is_silent(now));
  for (const StatusEvent& each : statuses_) events += each.event;
  return events;
}

}  // namespace crepes
