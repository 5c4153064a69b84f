/// Simulated robots that are steered by programs.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

#include "drivers/sim/motion_track.hpp"
#include "drivers/sim/world.hpp"
#include "estimator/core/result.hpp"
#include "net/udp_socket.hpp"

namespace crepes {

/// What a program sends in one datagram:
/// {"robot":2,"velocity":[vx,vy,vz],"turn_rate":w}
struct VelocityCommand {
  RobotId robot{};
  Eigen::Vector3d v_L_B = Eigen::Vector3d::Zero();  ///< level body axes: forward, left, up [m/s]
  double turn_rate_radps = 0.0;                     ///< to the left
};

/// Anything else is refused with the reason.
[[nodiscard]] Result<VelocityCommand> parse_velocity_command(std::string_view datagram);

/// Receives commands over UDP on 127.0.0.1, moves the robots, and writes their motions for all
/// daemons. Like an autopilot, it limits velocities to 1 m/s and 1 rad/s, and stops a robot that
/// has had no command for half a second.
class SteeredSwarm {
 public:
  /// `sim.track` is created; `port` 0 is any.
  [[nodiscard]] static Result<SteeredSwarm> open(const SimConfig& sim, std::uint16_t port);

  /// Writes what the robots do up to a tenth of a second after `world_s`, world time now. What was
  /// due before it came to this is the continuation of the last commands.
  [[nodiscard]] Result<void> run_until(double world_s);

  [[nodiscard]] std::uint16_t port() const { return socket_.local().port; }
  [[nodiscard]] std::uint64_t received() const { return received_; }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// Records that were written too late for a new command.
  [[nodiscard]] std::uint64_t late() const { return late_; }

 private:
  struct Steered {
    VelocityCommand command;
    double commanded_s = -1e9;  ///< world time of the command
    SteeredState state;
  };

  SteeredSwarm(UdpSocket socket, MotionTrackWriter track, SimWorld world);
  [[nodiscard]] Result<void> receive(double world_s);
  [[nodiscard]] SteeredState next_state(RobotId id, const Steered& robot, double begin_s) const;

  UdpSocket socket_;
  MotionTrackWriter track_;
  SimWorld world_;
  std::map<RobotId, Steered> robots_;
  std::uint64_t received_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t late_ = 0;
};

}  // namespace crepes
