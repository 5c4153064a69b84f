#include "daemon/ctl/live/watch_screen.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

using Row = std::vector<std::string>;

constexpr Duration kMaxPoseAge =
    std::chrono::seconds{3};  ///< a daemon silent for longer does not run
constexpr std::array<std::string_view, 5> kOrders{"id", "name", "distance", "sigma", "age"};

/// The columns of the table, and the decimals of its numbers.
struct Layout {
  std::vector<ScreenColumn> columns;
  int position;
  int angle;
  int sigma_deg;
};

/// Of 79 columns, or of 109 where there is room for more digits.
Layout layout_of(const ScreenFormat& format) {
  constexpr std::size_t kWide = 109;
  if (format.columns >= kWide) {
    return {.columns = {{"neighbor", 14},
                        {"mode", 10},
                        {"x m", 9},
                        {"y m", 9},
                        {"z m", 9},
                        {"roll", 8},
                        {"pitch", 8},
                        {"yaw deg", 8},
                        {"sigma m", 10},
                        {"sigma deg", 10},
                        {"age ms", 7},
                        {"Hz", 7}},
            .position = 3,
            .angle = 1,
            .sigma_deg = 2};
  }
  return {.columns = {{"neighbor", 10},
                      {"mode", 10},
                      {"x m", 7},
                      {"y m", 7},
                      {"z m", 7},
                      {"roll", 5},
                      {"pitch", 6},
                      {"yaw", 5},
                      {"+-m", 7},
                      {"+-deg", 6},
                      {"ms", 5},
                      {"Hz", 4}},
          .position = 2,
          .angle = 0,
          .sigma_deg = 1};
}

/// Instead of numbers, the reason why there is no pose, in full.
std::string reason_line(const std::string& name, const std::string& reason, const Layout& layout,
                        const ScreenFormat& format) {
  const Row cells{name, toned_mode("none", format)};
  const std::string begin = screen_row(layout.columns, cells) + "  ";
  const std::size_t indent = columns_of(begin);
  return begin + wrapped(reason, format.columns, indent, indent);
}

std::string line_of(const std::string& name, const NeighborView& view, Timestamp now,
                    const ScreenFormat& format) {
  const Layout layout = layout_of(format);
  const NeighborPose* pose = view.pose(now);
  if (pose == nullptr) return reason_line(name, view.reason(), layout, format);
  const PoseSigma sigma = sigma_of(pose->T_B_N.covariance);
  Row cells{name, toned_mode(name_of(pose->mode), format)};
  const auto add = [&](double value, int decimals) {
    cells.push_back(fitted(value, decimals, layout.columns[cells.size()].width - 1));
  };
  for (const double x : pose->T_B_N.pose.p) add(x, layout.position);
  for (const double angle : roll_pitch_yaw_of(pose->T_B_N.pose.q))
    add(kDegPerRad * angle, layout.angle);
  add(sigma.position_m, 3);
  add(kDegPerRad * sigma.rotation_rad, layout.sigma_deg);
  add(1e3 * pose->age_s, 0);
  add(view.rate_hz(now), 0);
  return screen_row(layout.columns, cells);
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

/// The age and the totals of each kind of measurement.
std::string details_of(const client::Status::Neighbor& neighbor, const ScreenFormat& format) {
  const std::vector<ScreenColumn> columns{{"source", 14}, {"age ms", 8}};
  std::string text =
      screen_titles(columns, format) + toned("  totals", Tone::kTitle, format) + "\n";
  const auto add = [&](const std::string& kind, double age_s, const std::string& totals) {
    const std::string begin = screen_row(columns, {kind, fixed(1e3 * age_s, 0)}) + "  ";
    const std::size_t indent = columns_of(begin);
    text += begin + wrapped(totals, format.columns, indent, indent) + "\n";
  };
  for (const auto& [kind, totals] : neighbor.measurements) {
    std::string counts;
    for (const auto& [verdict, total] : totals)
      counts += fmt::format("{}{} {}", counts.empty() ? "" : ", ", verdict, total);
    const auto age = neighbor.ages_s.find(kind);
    add(kind, age == neighbor.ages_s.end() ? std::nan("") : age->second, counts);
  }
  if (neighbor.reports) {
    add("reports", neighbor.reports->age_s,
        fmt::format("received {}, lost {}", neighbor.reports->received, neighbor.reports->lost));
  }
  return text;
}

std::string help_text(const ScreenFormat& format) {
  return toned("Keys", Tone::kTitle, format) +
         R"(
  q              quit
  ?              this help; any other key closes it
  s              sort by the next of id, name, distance, sigma, age
  j k, arrows    pick a neighbor
  Enter          its measurements, or no longer

)" + toned("Columns", Tone::kTitle, format) +
         R"(
  mode           direct: seen by one of the two within the last half second
                 graph: located through other robots
                 predicted: carried on by both IMUs, nothing is measured
                 none: no pose, and why
  x y z          the neighbor in this robot's body: ahead, left, up, meters
  roll pitch yaw its attitude against this robot's, degrees
  +-m, +-deg     one sigma of position and attitude, in the worst direction
  ms             since the newest measurement in the pose
  Hz             poses per second
)";
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
    NeighborView& view = neighbors_[id];
    if (neighbor.state == "none" && neighbor.reason.empty()) {  // its id alone
      left_out_.insert(id);
    } else {
      view.set_reason(neighbor.reason);
    }
  }
  if (status.sensors.empty()) {  // the answer about one neighbor
    if (!status.neighbors.empty() && picked_ == RobotId{status.neighbors.front().peer})
      details_ = status.neighbors.front();
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
  handle_command(key);
}

void WatchScreen::handle_command(char key) {
  if (std::exchange(shows_help_, false) && key != 'q') return;
  switch (key) {
    case 'q':
      quit_ = true;
      break;
    case '?':
      shows_help_ = true;
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

std::set<RobotId> WatchScreen::polled_neighbors() const {
  std::set<RobotId> polled = left_out_;
  if (const auto detailed = detailed_neighbor()) polled.insert(*detailed);
  return polled;
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

std::string WatchScreen::head(Timestamp now, const ScreenFormat& format) const {
  std::string head = "waiting for the daemon\n";
  const auto add = [&](const std::string& what, Tone tone) {
    head += toned(wrapped(what, format.columns, 2), tone, format) + "\n";
  };
  if (status_) {
    head.clear();
    add(fmt::format("robot {} {}, up {} s, {} % of a core, {} MB", status_->self, status_->name,
                    fixed(status_->uptime_s, 0), fixed(100.0 * cpu_share_, 1),
                    fixed(status_->rss_mb, 0)),
        Tone::kTitle);
    for (const client::Status::Sensor& sensor : status_->sensors) {
      if (sensor.ok) continue;
      const std::string what = sensor.message.empty() ? "fault" : sensor.message;
      add(fmt::format("{}: {}", sensor.name, what), Tone::kBad);
    }
  }
  if (last_message_time_ && now - *last_message_time_ > kMaxPoseAge) {
    add(fmt::format("no answer for {} s", fixed(to_seconds(now - *last_message_time_), 0)),
        Tone::kBad);
  }
  if (!error_.empty()) add("daemon: " + error_, Tone::kBad);
  return head;
}

std::string WatchScreen::table(Timestamp now, const ScreenFormat& format) const {
  std::string text = screen_titles(layout_of(format).columns, format) + "\n";
  for (const RobotId id : ordered(now)) {
    const std::string mark = !format.is_interactive ? "" : (picked_ == id ? "> " : "  ");
    text += line_of(mark + name_of_robot(id), neighbors_.at(id), now, format) + "\n";
  }
  return text;
}

std::string WatchScreen::foot(const ScreenFormat& format) const {
  const std::string legend = "direct: measured now   graph: by way of others   predicted: by IMUs";
  const std::string keys =
      fmt::format("q quit   ? help   s sort ({})   j k or arrows pick   Enter details",
                  kOrders.at(static_cast<std::size_t>(order_)));
  return toned(legend, Tone::kDim, format) + "\n" + toned(keys, Tone::kDim, format) + "\n";
}

std::string WatchScreen::text(Timestamp now, const ScreenFormat& format) const {
  if (shows_help_) return help_text(format);
  std::string text = head(now, format) + "\n" + table(now, format);
  if (!format.is_interactive) return text;
  if (shows_details_ && picked_ && details_ && details_->peer == picked_->value) {
    text += "\n" + toned(name_of_robot(*picked_), Tone::kTitle, format) + "\n" +
            details_of(*details_, format);
  }
  return text + "\n" + foot(format);
}

}  // namespace crepes
