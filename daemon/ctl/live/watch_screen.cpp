#include "daemon/ctl/live/watch_screen.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>

#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

using Row = std::vector<std::string>;

constexpr Duration kMaxPoseAge =
    std::chrono::seconds{3};  ///< a daemon silent for longer does not run
constexpr std::array<std::string_view, 5> kOrders{"id", "name", "distance", "sigma", "age"};

/// "x y z" with a fixed width, so that columns do not move.
std::string triple(const Eigen::Vector3d& v, int decimals) {
  std::string text;
  for (const double x : v) {
    const std::string cell = fixed(x, decimals);
    text += std::string(cell.size() < 8 ? 8 - cell.size() : 1, ' ') + cell;
  }
  return text;
}

Row row_of(const std::string& name, const NeighborView& view, Timestamp now) {
  const NeighborPose* pose = view.pose(now);
  if (pose == nullptr) return {name, "-", "", "", "", "", "", "", view.reason()};
  const PoseSigma sigma = sigma_of(pose->T_B_N.covariance);
  return {name,
          std::string(name_of(pose->mode)),
          triple(pose->T_B_N.pose.p, 3),
          triple(kDegPerRad * roll_pitch_yaw_of(pose->T_B_N.pose.q), 1),
          fixed(sigma.position_m, 3),
          fixed(kDegPerRad * sigma.rotation_rad, 2),
          fixed(1e3 * pose->age_s, 0),
          fixed(view.rate_hz(now), 0),
          ""};
}

/// The sort key of a neighbor; neighbors without a pose come last.
double rank_of(const NeighborView& view, WatchScreen::Order order, Timestamp now) {
  const NeighborPose* pose = view.pose(now);
  if (pose == nullptr) return std::numeric_limits<double>::infinity();
  switch (order) {
    case WatchScreen::Order::kDistance:
      return pose->T_B_N.pose.p.norm();
    case WatchScreen::Order::kSigma:
      return -sigma_of(pose->T_B_N.covariance).position_m;  // the largest first
    case WatchScreen::Order::kAge:
      return -pose->age_s;
    default:
      return 0.0;
  }
}

std::string details_of(const client::Status::Neighbor& neighbor) {
  std::vector<Row> rows{{"source", "age ms", "totals"}};
  for (const auto& [kind, totals] : neighbor.measurements) {
    std::string text;
    for (const auto& [verdict, total] : totals)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", verdict, total);
    const auto age = neighbor.ages_s.find(kind);
    rows.push_back({kind, age == neighbor.ages_s.end() ? "-" : fixed(1e3 * age->second, 0), text});
  }
  if (neighbor.reports) {
    rows.push_back(
        {"reports", fixed(1e3 * neighbor.reports->age_s, 0),
         fmt::format("received {}, lost {}", neighbor.reports->received, neighbor.reports->lost)});
  }
  return text_table(rows);
}

}  // namespace

void WatchScreen::handle_message(const client::Message& message, Timestamp now) {
  last_message_time_ = last_ = now;
  if (const auto* pose = std::get_if<client::Pose>(&message)) {
    names_[RobotId{pose->peer}] = pose->name;
    neighbors_[RobotId{pose->peer}].update(neighbor_pose_of(*pose), now);
  } else if (const auto* status = std::get_if<client::Status>(&message)) {
    handle_status(*status, now);
  } else if (const auto* refusal = std::get_if<client::Error>(&message)) {
    error_ = refusal->message;
  }
}

void WatchScreen::handle_status(const client::Status& status, Timestamp /*now*/) {
  for (const client::Status::Neighbor& neighbor : status.neighbors) {
    const RobotId id{neighbor.peer};
    if (!neighbor.name.empty()) names_[id] = neighbor.name;
    neighbors_[id].set_reason(neighbor.reason);
  }
  if (status.sensors.empty()) {  // the answer about one neighbor
    if (!status.neighbors.empty()) details_ = status.neighbors.front();
    return;
  }
  const double elapsed_s = status_ ? status.uptime_s - status_->uptime_s : status.uptime_s;
  const double used_s = status_ ? status.cpu_s - status_->cpu_s : status.cpu_s;
  if (elapsed_s > 0.0) cpu_share_ = used_s / elapsed_s;
  status_ = status;
}

void WatchScreen::handle_key(char key) {
  constexpr char kEscape = '\x1b';
  if (key == kEscape || !escape_.empty()) {
    escape_ += key;
    if (escape_ == "\x1b" || escape_ == "\x1b[") return;
    if (escape_ == "\x1b[A") pick(-1);
    if (escape_ == "\x1b[B") pick(1);
    escape_.clear();
    return;
  }
  switch (key) {
    case 'q':
      quit_ = true;
      break;
    case 's':
      order_ = static_cast<Order>((static_cast<std::size_t>(order_) + 1) % kOrders.size());
      break;
    case 'j':
      pick(1);
      break;
    case 'k':
      pick(-1);
      break;
    case '\r':
    case '\n':
      if (!picked_) pick(1);
      shows_details_ = !shows_details_;
      break;
    default:
      break;
  }
}

std::optional<RobotId> WatchScreen::detailed_neighbor() const {
  return shows_details_ ? picked_ : std::nullopt;
}

void WatchScreen::pick(int step) {
  const std::vector<RobotId> ids = ordered(last_);
  if (ids.empty()) return;
  const auto last = static_cast<std::ptrdiff_t>(ids.size()) - 1;
  std::ptrdiff_t at = step > 0 ? 0 : last;
  if (const auto found = std::ranges::find(ids, picked_); found != ids.end())
    at = std::clamp<std::ptrdiff_t>(found - ids.begin() + step, 0, last);
  picked_ = ids[static_cast<std::size_t>(at)];
}

std::string WatchScreen::name_of_robot(RobotId id) const {
  const auto name = names_.find(id);
  return name == names_.end() ? std::to_string(id.value) : name->second;
}

std::vector<RobotId> WatchScreen::ordered(Timestamp now) const {
  std::vector<RobotId> ids;
  for (const auto& [id, view] : neighbors_) ids.push_back(id);
  std::ranges::stable_sort(ids, [&](RobotId a, RobotId b) {
    if (order_ == Order::kName) return name_of_robot(a) < name_of_robot(b);
    return rank_of(neighbors_.at(a), order_, now) < rank_of(neighbors_.at(b), order_, now);
  });
  return ids;
}

std::string WatchScreen::head(Timestamp now) const {
  std::string head = "waiting for the daemon\n";
  if (status_) {
    head = fmt::format("robot {} {}, up {} s, {} % of a core, {} MB\n", status_->self,
                       status_->name, fixed(status_->uptime_s, 0), fixed(100.0 * cpu_share_, 1),
                       fixed(status_->rss_mb, 0));
    for (const client::Status::Sensor& sensor : status_->sensors) {
      if (!sensor.ok) {
        head +=
            fmt::format("{}: {}\n", sensor.name, sensor.message.empty() ? "fault" : sensor.message);
      }
    }
  }
  if (last_message_time_ && now - *last_message_time_ > kMaxPoseAge)
    head += fmt::format("no answer for {} s\n", fixed(to_seconds(now - *last_message_time_), 0));
  if (!error_.empty()) head += fmt::format("daemon: {}\n", error_);
  return head;
}

std::string WatchScreen::text(Timestamp now, bool is_interactive) const {
  std::vector<Row> rows{{"neighbor", "mode", "position x y z [m]", "roll pitch yaw [deg]",
                         "sigma m", "deg", "age ms", "rate Hz", "why not"}};
  for (const RobotId id : ordered(now)) {
    const std::string mark = !is_interactive ? "" : (picked_ == id ? "> " : "  ");
    rows.push_back(row_of(mark + name_of_robot(id), neighbors_.at(id), now));
  }
  std::string text = head(now) + "\n" + text_table(rows);
  if (!is_interactive) return text;
  if (shows_details_ && picked_ && details_ && details_->peer == picked_->value)
    text += fmt::format("\n{}\n{}", name_of_robot(*picked_), details_of(*details_));
  return text + "\nq quit   s sort (" + std::string(kOrders.at(static_cast<std::size_t>(order_))) +
         ")   j k or arrows pick   Enter details\n";
}

}  // namespace crepes
