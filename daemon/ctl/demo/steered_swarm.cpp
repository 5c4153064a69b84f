#include "daemon/ctl/demo/steered_swarm.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr double kHorizon = 0.1;        ///< s; daemons must have a motion before its time
constexpr double kMinNotice = 0.02;     ///< s; a command does not act sooner after its record
constexpr double kCommandExpiry = 0.5;  // s
constexpr double kMaxSpeed = 1.0;       // m/s
constexpr double kMaxTurnRate = 1.0;    // rad/s

SteeredState continued(const SteeredState& s, double t_s, const Eigen::Vector3d& v_W_B,
                       double turn_rate_radps) {
  return {.x = s.x.after(t_s, v_W_B.x()),
          .y = s.y.after(t_s, v_W_B.y()),
          .z = s.z.after(t_s, v_W_B.z()),
          .yaw = s.yaw.after(t_s, turn_rate_radps)};
}

Eigen::Vector3d limited(const Eigen::Vector3d& v) {
  return v.norm() > kMaxSpeed ? Eigen::Vector3d(kMaxSpeed * v.normalized()) : v;
}

}  // namespace

Result<VelocityCommand> parse_velocity_command(std::string_view datagram) try {
  const auto json = nlohmann::json::parse(datagram);
  const auto id = json.at("robot").get<std::int64_t>();
  if (id < 1 || id > 65534) return fail(ErrorCode::kFormat, "command: robot is no id");
  const auto v = json.at("velocity").get<std::vector<double>>();
  if (v.size() != 3) return fail(ErrorCode::kFormat, "command: velocity has three numbers");
  const VelocityCommand command{.robot = RobotId{static_cast<std::uint16_t>(id)},
                                .v_L_B = {v[0], v[1], v[2]},
                                .turn_rate_radps = json.value("turn_rate", 0.0)};
  if (!command.v_L_B.allFinite() || !std::isfinite(command.turn_rate_radps))
    return fail(ErrorCode::kFormat, "command: not a finite number");
  return command;
} catch (const nlohmann::json::exception& e) {
  return fail(ErrorCode::kFormat, std::string("command: ") + e.what());
}

Result<SteeredSwarm> SteeredSwarm::open(const SimConfig& sim, std::uint16_t port) {
  SimConfig unsteered = sim;
  unsteered.track.clear();
  const std::size_t robots = SimWorld(unsteered).robots().size();
  return UdpSocket::bind("127.0.0.1", port).and_then([&](UdpSocket&& socket) {
    return MotionTrackWriter::create(sim.track, robots).map([&](MotionTrackWriter&& track) {
      return SteeredSwarm(std::move(socket), std::move(track), SimWorld(sim));
    });
  });
}

SteeredSwarm::SteeredSwarm(UdpSocket socket, MotionTrackWriter track, SimWorld world)
    : socket_(std::move(socket)), track_(std::move(track)), world_(std::move(world)) {
  for (const RobotId id : world_.robots()) robots_[id] = {};
}

Result<void> SteeredSwarm::receive(double world_s) {
  constexpr int kMaxAtOnce = 100;
  for (int i = 0; i < kMaxAtOnce; ++i) {
    const auto datagram = socket_.receive(std::chrono::milliseconds{0});
    if (!datagram) return tl::unexpected(datagram.error());
    if (!*datagram) return {};
    const std::string text((*datagram)->bytes.begin(), (*datagram)->bytes.end());
    const Result<VelocityCommand> command = parse_velocity_command(text);
    const auto robot = command ? robots_.find(command->robot) : robots_.end();
    if (robot == robots_.end()) {
      ++refused_;
      continue;
    }
    ++received_;
    robot->second.command = *command;
    robot->second.commanded_s = world_s;
  }
  return {};
}

/// Level body axes at the moment at which the command begins to act.
SteeredState SteeredSwarm::next_state(RobotId id, const Steered& robot, double begin_s) const {
  const bool is_expired = begin_s - robot.commanded_s > kCommandExpiry + kHorizon;
  if (is_expired) return continued(robot.state, begin_s, Eigen::Vector3d::Zero(), 0.0);
  const Eigen::Matrix3d R_W_B = world_.T_W_B(id, begin_s).q.toRotationMatrix();
  const Eigen::AngleAxisd R_W_L(std::atan2(R_W_B(1, 0), R_W_B(0, 0)), Eigen::Vector3d::UnitZ());
  return continued(robot.state, begin_s, R_W_L * limited(robot.command.v_L_B),
                   std::clamp(robot.command.turn_rate_radps, -kMaxTurnRate, kMaxTurnRate));
}

Result<void> SteeredSwarm::run_until(double world_s) {
  if (auto done = receive(world_s); !done) return done;
  while (track_.next_s() <= world_s + kHorizon) {
    const double begin_s = track_.next_s();
    const bool is_late = begin_s < world_s + kMinNotice;
    if (is_late) ++late_;
    std::vector<SteeredState> record;
    for (auto& [id, robot] : robots_) {
      const SteeredState& s = robot.state;
      robot.state =
          is_late ? continued(s, begin_s, {s.x.command, s.y.command, s.z.command}, s.yaw.command)
                  : next_state(id, robot, begin_s);
      record.push_back(robot.state);
    }
    if (auto done = track_.append(record); !done) return done;
  }
  return {};
}

}  // namespace crepes
