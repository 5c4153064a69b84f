/// A client of the daemon's pose subscription.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/core/result.hpp"
#include "net/udp_socket.hpp"

namespace crepes {

struct VersionMessage {
  std::string release;
  double lease_s = 0.0;
};

/// POSE. What the daemon left out has its default.
struct PoseMessage {
  RobotId self{};
  std::string name;  ///< the neighbor's
  NeighborPose pose;
};

/// STATUS, as far as a table shows it.
struct StatusMessage {
  struct Neighbor {
    RobotId neighbor{};
    std::string name;
    std::string state;   ///< a mode, or "none"
    std::string reason;  ///< why there is no pose
  };
  struct Sensor {
    std::string name;
    double rate_hz = 0.0;
    bool ok = false;
    std::string message;
  };
  struct Clock {
    RobotId peer{};
    double offset_s = 0.0;
    double skew_ppm = 0.0;
    double sigma_s = 0.0;
  };
  RobotId self{};
  std::string name;
  double uptime_s = 0.0;
  std::vector<Neighbor> neighbors;
  std::vector<Sensor> sensors;
  std::vector<Clock> clocks;
};

/// What a daemon elsewhere wants to see again before it says more.
struct CookieMessage {
  std::string cookie;
};

struct ErrorMessage {
  std::string message;
};

using DaemonMessage =
    std::variant<VersionMessage, PoseMessage, StatusMessage, CookieMessage, ErrorMessage>;

/// Classes that are not known, and what does not parse, are errors.
[[nodiscard]] Result<DaemonMessage> parse_message(std::string_view datagram);

/// One datagram as it came, and what it says.
struct DaemonAnswer {
  std::string text;
  DaemonMessage message;
};

class DaemonClient {
 public:
  /// `address` is numeric, IPv4 or IPv6.
  [[nodiscard]] static Result<DaemonClient> open(const std::string& address, std::uint16_t port);

  /// Asks for poses, or renews the lease; a daemon that is not there goes unnoticed.
  [[nodiscard]] Result<void> watch();
  [[nodiscard]] Result<void> unwatch();
  [[nodiscard]] Result<void> poll();
  /// Asks for everything about one neighbor.
  [[nodiscard]] Result<void> poll(RobotId neighbor);
  /// Asks for one part of the status: "sensors" or "network".
  [[nodiscard]] Result<void> poll(std::string_view part);

  /// The next message, or nothing within `timeout`. Datagrams from elsewhere, cookies (which it
  /// echoes by itself) and what does not parse count as nothing.
  [[nodiscard]] Result<std::optional<DaemonAnswer>> receive(std::chrono::milliseconds timeout);

  [[nodiscard]] int descriptor() const { return socket_.descriptor(); }
  [[nodiscard]] std::uint64_t malformed() const { return malformed_; }

 private:
  DaemonClient(UdpSocket socket, Endpoint daemon) : socket_(std::move(socket)), daemon_(daemon) {}

  /// `request` is a JSON object but for its end.
  [[nodiscard]] Result<void> ask(const std::string& request);
  [[nodiscard]] Result<void> send(const std::string& request);
  void take_cookie(const std::string& cookie);

  UdpSocket socket_;
  Endpoint daemon_;
  std::string cookie_;
  std::vector<std::string> unanswered_;  ///< asked again once there is a cookie
  std::uint64_t malformed_ = 0;
};

}  // namespace crepes
