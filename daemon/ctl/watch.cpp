#include "daemon/ctl/watch.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <numbers>
#include <vector>

#include "daemon/ctl/daemon_client.hpp"
#include "daemon/ctl/live_screen.hpp"
#include "daemon/ctl/neighbor_view.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/monotonic_clock.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;
using Row = std::vector<std::string>;

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr Duration kRenewal = 1s;   ///< of WATCH and POLL
constexpr Duration kPatience = 3s;  ///< a daemon silent for longer is not there

/// Everything heard from one daemon.
struct Watched {
  std::map<RobotId, NeighborView> neighbors;
  std::map<RobotId, std::string> names;
  std::optional<StatusMessage> status;
  std::optional<Timestamp> heard;
  std::string error;

  void take(const DaemonMessage& message, Timestamp now) {
    heard = now;
    if (const auto* pose = std::get_if<PoseMessage>(&message)) {
      names[pose->pose.neighbor] = pose->name;
      neighbors[pose->pose.neighbor].on_pose(pose->pose, now);
    } else if (const auto* state = std::get_if<StatusMessage>(&message)) {
      status = *state;
      for (const StatusMessage::Neighbor& neighbor : state->neighbors) {
        if (!neighbor.name.empty()) names[neighbor.neighbor] = neighbor.name;
        neighbors[neighbor.neighbor].on_reason(neighbor.reason);
      }
    } else if (const auto* refusal = std::get_if<ErrorMessage>(&message)) {
      error = refusal->message;
    }
  }
};

/// "x y z" with a fixed width, so that the table does not tremble.
std::string triple(const Eigen::Vector3d& v, int decimals) {
  std::string text;
  for (const double x : v) {
    const std::string cell = fixed(x, decimals);
    text += std::string(cell.size() < 8 ? 8 - cell.size() : 1, ' ') + cell;
  }
  return text;
}

Row neighbor_row(const std::string& name, const NeighborView& view, Timestamp now) {
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

std::string table_of(const Watched& watched, Timestamp now) {
  std::string head = "waiting for the daemon\n";
  if (watched.status) {
    head = "robot " + std::to_string(watched.status->self.value) + " " + watched.status->name +
           ", up " + fixed(watched.status->uptime_s, 0) + " s\n";
  }
  if (watched.heard && now - *watched.heard > kPatience)
    head += "no answer for " + fixed(to_seconds(now - *watched.heard), 0) + " s\n";
  if (!watched.error.empty()) head += "daemon: " + watched.error + "\n";
  std::vector<Row> rows{{"neighbor", "mode", "position x y z [m]", "roll pitch yaw [deg]",
                         "sigma m", "deg", "age ms", "rate Hz", "why not"}};
  for (const auto& [id, view] : watched.neighbors) {
    const auto name = watched.names.find(id);
    rows.push_back(neighbor_row(
        name == watched.names.end() ? std::to_string(id.value) : name->second, view, now));
  }
  return head + "\n" + text_table(rows);
}

Error silent(const WatchOptions& options) {
  return {ErrorCode::kNotFound, "no answer from " + options.address + " port " +
                                    std::to_string(options.port) + ": is crepesd running there?"};
}

/// Speaks and listens; `show` is called with what is known after every message or pause and says
/// whether to go on.
template <class Show>
Result<void> converse(const WatchOptions& options, const Show& show) {
  Result<DaemonClient> client = DaemonClient::open(options.address, options.port);
  if (!client) return tl::unexpected(client.error());
  const MonotonicClock clock;
  const Timestamp start = clock.now();
  Timestamp renewal = start;
  StopSignals stop;
  Watched watched;
  for (;;) {
    const Timestamp now = clock.now();
    if (stop.requested() || (options.for_s && now - start >= from_seconds(*options.for_s))) break;
    if (now >= renewal) {
      if (auto sent = client->watch().and_then([&] { return client->poll(); }); !sent) return sent;
      renewal = now + kRenewal;
    }
    auto answer = client->receive(50ms);
    if (!answer) return tl::unexpected(answer.error());
    if (*answer) watched.take((*answer)->message, clock.now());
    if (!watched.heard && now - start > kPatience) return tl::unexpected(silent(options));
    if (!show(watched, *answer, clock.now())) break;
  }
  if (!watched.heard) return tl::unexpected(silent(options));
  return client->unwatch();
}

Result<void> stream_json(const WatchOptions& options) {
  return converse(options, [](const Watched&, const std::optional<DaemonAnswer>& answer,
                              Timestamp) { return !answer || print(answer->text + "\n"); });
}

/// Poses come by themselves within a period or two; STATUS names all neighbors.
Result<void> show_once(const WatchOptions& options) {
  constexpr Duration kCollect = 300ms;
  std::optional<Timestamp> first;
  return converse(options, [&](const Watched& watched, const auto&, Timestamp now) {
    if (!watched.status) return true;
    if (!first) first = now;
    if (now - *first < kCollect) return true;
    print(table_of(watched, now));
    return false;
  });
}

Result<void> show_live(const WatchOptions& options) {
  LiveScreen screen;
  const Duration period = screen.is_terminal() ? 100ms : 1000ms;
  Timestamp next{};
  return converse(options, [&](const Watched& watched, const auto&, Timestamp now) {
    if (now < next) return true;
    next = now + period;
    screen.show(table_of(watched, now));
    return true;
  });
}

std::string status_text(const StatusMessage& status) {
  std::string text = "robot " + std::to_string(status.self.value) + " " + status.name + ", up " +
                     fixed(status.uptime_s, 1) + " s\n\n";
  std::vector<Row> sensors{{"sensor", "rate Hz", "state"}};
  for (const auto& sensor : status.sensors) {
    sensors.push_back({sensor.name, fixed(sensor.rate_hz, 1),
                       sensor.ok ? "ok" : (sensor.message.empty() ? "fault" : sensor.message)});
  }
  std::vector<Row> neighbors{{"neighbor", "state", "why not"}};
  for (const auto& neighbor : status.neighbors) {
    neighbors.push_back(
        {neighbor.name.empty() ? std::to_string(neighbor.neighbor.value) : neighbor.name,
         neighbor.state, neighbor.reason});
  }
  std::vector<Row> clocks{{"clock of", "offset s", "skew ppm", "sigma ms"}};
  for (const auto& clock : status.clocks) {
    clocks.push_back({std::to_string(clock.peer.value), fixed(clock.offset_s, 6),
                      fixed(clock.skew_ppm, 2), fixed(1e3 * clock.sigma_s, 3)});
  }
  return text + text_table(sensors) + "\n" + text_table(neighbors) + "\n" + text_table(clocks);
}

}  // namespace

Result<void> watch(const WatchOptions& options) {
  if (options.json) return stream_json(options);
  return options.once ? show_once(options) : show_live(options);
}

Result<void> print_status(const WatchOptions& options) {
  Result<DaemonClient> client = DaemonClient::open(options.address, options.port);
  if (!client) return tl::unexpected(client.error());
  constexpr int kAttempts = 3;  // a datagram may get lost
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (auto sent = client->poll(); !sent) return sent;
    const auto answer = client->receive(1000ms);
    if (!answer) return tl::unexpected(answer.error());
    if (!*answer) continue;
    if (const auto* status = std::get_if<StatusMessage>(&(*answer)->message)) {
      print(options.json ? (*answer)->text + "\n" : status_text(*status));
      return {};
    }
    if (const auto* refusal = std::get_if<ErrorMessage>(&(*answer)->message))
      return fail(ErrorCode::kIo, "daemon: " + refusal->message);
  }
  return tl::unexpected(silent(options));
}

}  // namespace crepes
