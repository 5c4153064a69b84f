/// Poses and status of a crepesd: C++17, and no library but the standard one.
///
///     std::string fault;
///     auto daemon = crepes::client::Connection::open({}, {}, fault);
///     while (daemon) {
///       const auto answer = daemon->receive(std::chrono::seconds{1});
///       if (!answer) continue;  // nothing new; the daemon is asked again without further ado
///       if (const auto* pose = std::get_if<crepes::client::Pose>(&answer->message))
///         std::cout << pose->name << " is " << pose->position.x << " m ahead\n";
///     }
///
/// SI units. B is the observer's body (x forward, y left, z up), N the neighbor's. Not thread-safe:
/// a connection belongs to one thread.
#pragma once

#include <netinet/in.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace crepes::client {

/// Three coordinates.
struct Vector {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

/// Hamilton, of unit length.
struct Quaternion {
  double w = 1.0;
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

/// Where a pose comes from: the robot's own measurements, other robots, or the inertial sensors
/// alone since the last measurement.
enum class Mode : std::uint8_t { kDirect, kGraph, kPredicted };
[[nodiscard]] std::string_view name_of(Mode mode);

/// The answer to the first request.
struct Version {
  std::string release;
  int proto_major = 0;
  int proto_minor = 0;
  double lease_s = 0.0;  ///< how long a subscription lasts without a further request
};

/// T_B_N: maps coordinates in the neighbor's body to coordinates in the observer's.
struct Pose {
  std::int64_t t_ns = 0;   ///< time of the state, on the robot's monotonic clock
  std::uint16_t self = 0;  ///< the observer
  std::uint16_t peer = 0;  ///< the neighbor
  std::string name;        ///< the neighbor's
  Mode mode = Mode::kPredicted;
  Vector position;                 ///< of N's origin, in B's axes [m]
  Quaternion orientation;          ///< rotates coordinates in N's axes into B's
  std::optional<Vector> velocity;  ///< of N minus B over ground, in B's axes [m/s]
  std::optional<Vector> up;        ///< against gravity, in B's axes
  /// Upper triangle, row by row, of the covariance of [dp, dtheta]: dp in B's axes [m],
  /// R_true = R Exp(dtheta) with dtheta in N's axes [rad].
  std::optional<std::array<double, 21>> covariance;
  std::uint64_t seq = 0;
  std::optional<std::int64_t> t_pub_ns;  ///< when the pose left the estimator
  double age_s = 0.0;                    ///< of the newest measurement in it
  std::uint32_t reset_counter = 0;       ///< increases when the estimate jumps
  std::vector<std::string> sources;      ///< kinds of the measurements in it
};

/// The whole matrix of a covariance's upper triangle.
[[nodiscard]] std::array<std::array<double, 6>, 6> matrix_of(
    const std::array<double, 21>& covariance);

/// What the daemon omitted keeps its default. `Answer::text` has the rest.
struct Status {
  using Totals = std::map<std::string, std::uint64_t>;  ///< by name

  /// A neighbor's datagrams.
  struct Reports {
    std::uint64_t received = 0;
    std::uint64_t lost = 0;
    std::uint64_t restarts = 0;
    double age_s = 0.0;
    double loss = 0.0;  ///< of the last seconds
  };
  /// One neighbor of the robot. Where STATUS has no room for more than its id, it has neither a
  /// pose nor a reason: ask for it by itself.
  struct Neighbor {
    std::uint16_t peer = 0;
    std::string name;
    std::string state = "none";                  ///< a mode, or "none"
    std::string reason;                          ///< why there is no pose
    std::map<std::string, Totals> measurements;  ///< by kind and verdict
    std::map<std::string, double> ages_s;  ///< of the newest of each kind, and inertial sample
    std::optional<Reports> reports;
    std::vector<std::string> faults;  ///< what the team finds wrong with it
  };
  /// One sensor of the robot.
  struct Sensor {
    std::string name;
    double rate_hz = 0.0;
    bool ok = false;
    std::string message;  ///< what is wrong, and what to do
    Totals faults;
    Totals counts;           ///< totals of zero are omitted; all are, where STATUS has no room
    bool calibrated = true;  ///< false: a camera whose lens is a guess
  };
  /// The neighbor's clock minus ours. A STATUS of all neighbors may have no room for its rate and
  /// its error; one of that neighbor has.
  struct Clock {
    std::uint16_t peer = 0;
    double offset_s = 0.0;
    std::optional<double> skew_ppm{};
    std::optional<double> sigma_s{};
  };
  /// How datagrams between robots are protected, and their airtime.
  struct Mesh {
    bool sealed = false;
    bool signs = false;
    std::string warning;  ///< who could speak for whom
    double airtime = 0.0;
    double airtime_of_all = 0.0;
  };

  /// A value with its one sigma; a scalar has one component.
  struct Estimate {
    std::vector<double> value;
    std::vector<double> sigma;
  };
  /// How well measurements of a kind agree with what was expected of them.
  struct Residual {
    std::optional<double> nis;  ///< mean normalized innovation squared for each dimension
    std::uint64_t fused = 0;
    std::uint64_t refused = 0;
  };
  /// How far a camera points from where its calibration says.
  struct Camera {
    std::vector<double> p_body_camera;  ///< [m]
    std::string state;                  ///< "calibrated", "turned" or "left_out"
    std::map<std::string, Estimate> estimates;
  };
  /// A robot as the team's filter knows it.
  struct TeamRobot {
    std::uint16_t robot = 0;
    std::string name;
    bool trusted = false;
    std::map<std::string, double> nis;          ///< by kind
    std::map<std::string, Residual> residuals;  ///< by kind; only if asked for this robot
    std::map<std::string, Estimate> calibration;
    std::vector<Camera> cameras;
    std::vector<std::string> faults;
  };
  /// The robots that the team's filter estimates.
  struct Team {
    std::optional<double> age_s;  ///< of the newest solution; empty without one
    std::vector<TeamRobot> robots;
  };
  /// What a neighbor's own filter knows of the sensors.
  struct Pair {
    std::uint16_t peer = 0;
    std::string name;
    std::map<std::string, Residual> residuals;
    std::map<std::string, Estimate> calibration;
  };

  std::uint16_t self = 0;
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
  Totals estimator;    ///< inputs that it could not use, lights that are no members
  Totals refused_imu;  ///< samples of our IMU, by reason
  std::optional<Mesh> mesh;
  std::optional<Team> team;   ///< only if asked for
  std::optional<Pair> pair;   ///< only if asked for
  bool is_truncated = false;  ///< parts are missing, because a datagram is short
};

/// A request was refused.
struct Error {
  std::string message;
};

using Message = std::variant<Version, Pose, Status, Error>;

/// The message in a datagram of the daemon. Empty for anything else.
[[nodiscard]] std::optional<Message> parse(std::string_view datagram);

/// One datagram: its content, and its text.
struct Answer {
  Message message;
  std::string text;
};

/// A request for STATUS that is repeated every `period_s`: of everything as far as it fits, of one
/// neighbor, of one sensor, or of one part: "sensors", "network", "team" (of `peer` in full, if
/// there is one) or "pair" of `peer`.
struct Poll {
  std::optional<std::uint16_t> peer{};
  std::string about{};
  double period_s = 1.0;
  std::string sensor{};  ///< as STATUS names it; empty: none
};

/// What a program wants from the daemon.
struct Requests {
  bool watch = true;                   ///< poses
  std::optional<double> rate_hz{};     ///< of each neighbor's poses; empty: every pose
  std::vector<std::uint16_t> peers{};  ///< empty: all
  std::vector<Poll> polls{};
  double retry_s = 0.25;  ///< how often a silent daemon is asked
};

/// Which request is due when, and what the answers change: neither socket nor clock. For programs
/// with sockets of their own.
class Conversation {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit Conversation(const Requests& requests) { ask(requests); }

  /// Replaces the requests. All of them are due at once; poses end where they are not wanted.
  void ask(const Requests& requests);

  /// The datagrams to send now.
  [[nodiscard]] std::vector<std::string> due(Time now);
  /// When the next request is due.
  [[nodiscard]] Time next_due() const;
  /// The message in a datagram from the daemon. Empty for a cookie, which is echoed with the next
  /// requests, and for what is no message.
  [[nodiscard]] std::optional<Answer> take(std::string datagram, Time now);
  /// The datagram that ends the subscription; empty without one.
  [[nodiscard]] std::optional<std::string> farewell() const;

  [[nodiscard]] const std::optional<Version>& version() const { return version_; }
  /// When a message came for the last time.
  [[nodiscard]] const std::optional<Time>& heard() const { return heard_; }
  /// Datagrams that were no messages.
  [[nodiscard]] std::uint64_t malformed() const { return malformed_; }

 private:
  struct Periodic {
    std::string request;  ///< a JSON object without its closing brace
    std::chrono::duration<double> period;
    Time due;
  };

  void renew_within(double lease_s);
  [[nodiscard]] bool is_silent(Time now) const;
  [[nodiscard]] std::string signed_with_cookie(const std::string& request) const;

  std::vector<Periodic> periodic_;
  std::vector<std::string> once_;  ///< requests without repetition
  std::chrono::duration<double> retry_{};
  std::chrono::duration<double> renewal_{1.0};
  bool is_watching_ = false;
  std::string cookie_;
  std::optional<Version> version_;
  std::optional<Time> heard_;
  std::uint64_t malformed_ = 0;
};

/// Where a daemon serves poses.
struct Address {
  std::string address = "127.0.0.1";  ///< numeric, IPv4 or IPv6
  std::uint16_t port = 47475;
};

/// A socket that asks a daemon and hears nobody else. A lost request, a daemon that restarts and a
/// network that was away need nothing of the program: requests are repeated.
class Connection {
 public:
  /// Empty if the address is none or there is no socket; `fault` then says why. A missing daemon
  /// is not detected: see `silent_for`.
  [[nodiscard]] static std::optional<Connection> open(const Address& daemon,
                                                      const Requests& requests, std::string& fault);
  Connection(Connection&& other) noexcept;
  Connection& operator=(Connection&& other) noexcept;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  /// Ends the subscription.
  ~Connection();

  /// Asks for something else from now on.
  void ask(const Requests& requests) { conversation_.ask(requests); }

  /// Sends the requests that are due and returns the next message. Empty after `timeout`, or when a
  /// signal came. With a timeout of zero it does not wait: call it at least once a second and
  /// whenever `descriptor` is readable.
  [[nodiscard]] std::optional<Answer> receive(std::chrono::milliseconds timeout);

  /// How long the daemon has sent nothing, at first since the beginning.
  [[nodiscard]] std::chrono::duration<double> silent_for() const;
  /// The daemon's, once it has answered.
  [[nodiscard]] const std::optional<Version>& version() const { return conversation_.version(); }
  /// Why the last request could not be sent; empty if it could.
  [[nodiscard]] std::string send_fault() const;
  /// For poll() and its like.
  [[nodiscard]] int descriptor() const { return socket_; }
  /// Datagrams of the daemon that were no messages.
  [[nodiscard]] std::uint64_t malformed() const { return conversation_.malformed(); }

 private:
  Connection(int socket, const sockaddr_in6& daemon, const Requests& requests);
  void send(const std::string& datagram);
  [[nodiscard]] std::optional<std::string> read();
  [[nodiscard]] std::optional<Answer> take_all(Conversation::Time now);
  void close();

  int socket_ = -1;
  sockaddr_in6 daemon_{};  ///< an IPv4 address in its first bytes, where its family says so
  Conversation conversation_;
  Conversation::Time opened_;
  int send_errno_ = 0;
};

}  // namespace crepes::client
