/// A client of the daemon's pose subscription.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
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

/// POSE. Fields that the daemon omitted keep their defaults.
struct PoseMessage {
  RobotId self{};
  std::string name;  ///< the neighbor's
  NeighborPose pose;
};

/// STATUS. Fields that the daemon omitted keep their defaults; totals are by name.
struct StatusMessage {
  using Totals = std::map<std::string, std::uint64_t>;
  struct Reports {
    std::uint64_t received = 0;
    std::uint64_t lost = 0;
    std::uint64_t restarts = 0;
    double age_s = 0.0;
    double loss = 0.0;  ///< of the last seconds
  };
  struct Neighbor {
    RobotId neighbor{};
    std::string name;
    std::string state;                           ///< a mode, or "none"
    std::string reason;                          ///< why there is no pose
    std::map<std::string, Totals> measurements;  ///< by kind and verdict
    std::map<std::string, double>
        ages_s;  ///< age of the newest measurement of each kind, and of the newest IMU sample
    std::optional<Reports> reports;
    std::vector<std::string> faults;  ///< what the team finds wrong with it
  };
  struct Sensor {
    std::string name;
    double rate_hz = 0.0;
    bool ok = false;
    std::string message;
    Totals faults;
    Totals counts;
  };
  struct Clock {
    RobotId peer{};
    double offset_s = 0.0;
    double skew_ppm = 0.0;
    double sigma_s = 0.0;
  };
  struct Mesh {
    bool sealed = false;
    bool signs = false;
    std::string warning;  ///< who could speak for whom
    double airtime = 0.0;
    double airtime_of_all = 0.0;
  };
  RobotId self{};
  std::string name;
  double uptime_s = 0.0;
  std::vector<std::string> faults;  ///< what the team finds wrong with this robot
  double cpu_s = 0.0;
  double rss_mb = 0.0;
  std::vector<Neighbor> neighbors;
  std::vector<Sensor> sensors;
  std::vector<Clock> clocks;
  Totals queues;
  Totals network;
  std::optional<Mesh> mesh;
};

/// A remote daemon requires it in every further request.
struct CookieMessage {
  std::string cookie;
};

struct ErrorMessage {
  std::string message;
};

using DaemonMessage =
    std::variant<VersionMessage, PoseMessage, StatusMessage, CookieMessage, ErrorMessage>;

/// An unknown class or invalid JSON is an error.
[[nodiscard]] Result<DaemonMessage> parse_message(std::string_view datagram);

/// Where a daemon serves poses.
struct DaemonAddress {
  std::string address = "127.0.0.1";  ///< numeric, IPv4 or IPv6
  std::uint16_t port = 47475;
};

/// The error for a daemon that did not answer.
[[nodiscard]] Error no_answer_from(const DaemonAddress& daemon);

/// One datagram: its text, and its parsed content.
struct DaemonAnswer {
  std::string text;
  DaemonMessage message;
};

class DaemonClient {
 public:
  /// `address` is numeric, IPv4 or IPv6.
  [[nodiscard]] static Result<DaemonClient> open(const std::string& address, std::uint16_t port);
  [[nodiscard]] static Result<DaemonClient> open(const DaemonAddress& daemon) {
    return open(daemon.address, daemon.port);
  }

  /// Requests poses, or renews the lease. A missing daemon is not detected.
  [[nodiscard]] Result<void> watch();
  [[nodiscard]] Result<void> unwatch();
  [[nodiscard]] Result<void> poll();
  /// Requests all status of one neighbor.
  [[nodiscard]] Result<void> poll(RobotId neighbor);
  /// Requests one part of the status: "sensors" or "network".
  [[nodiscard]] Result<void> poll(std::string_view part);

  /// The next message, or empty after `timeout`. Datagrams from other senders, invalid ones and
  /// cookies (which the client echoes by itself) return empty.
  [[nodiscard]] Result<std::optional<DaemonAnswer>> receive(std::chrono::milliseconds timeout);

  [[nodiscard]] int descriptor() const { return socket_.descriptor(); }
  [[nodiscard]] std::uint64_t malformed() const { return malformed_; }

 private:
  DaemonClient(UdpSocket socket, Endpoint daemon) : socket_(std::move(socket)), daemon_(daemon) {}

  /// `request` is a JSON object without its closing brace.
  [[nodiscard]] Result<void> ask(const std::string& request);
  [[nodiscard]] Result<void> send(const std::string& request);
  void store_cookie(const std::string& cookie);

  UdpSocket socket_;
  Endpoint daemon_;
  std::string cookie_;
  std::vector<std::string> unanswered_;  ///< repeated once there is a cookie
  std::uint64_t malformed_ = 0;
};

}  // namespace crepes
