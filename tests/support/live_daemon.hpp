/// Daemons of the simulated pair in this process, and a program that asks them.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/service/logging.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/sim/sim_clock.hpp"
#include "drivers/sim/world.hpp"
#include "net/udp_socket.hpp"
#include "tests/support/places.hpp"

namespace crepes {

using Json = nlohmann::json;
// What is awaited comes within a few seconds; this is for machines that do much else, sanitized.
inline constexpr Duration kPatience = std::chrono::seconds{60};

#if defined(CREPES_TSAN) || defined(CREPES_ASAN)
inline constexpr bool kIsSanitized = true;
#else
inline constexpr bool kIsSanitized = false;
#endif

inline int free_port() { return UdpSocket::bind("127.0.0.1", 0)->local().port; }

/// Robot `id` of the simulated pair, alone on its subscription port.
inline Config pair_config(std::uint16_t id, int mesh_port) {
  const std::string file = "/config/examples/four-simulated/r" + std::to_string(id) + ".yaml";
  Config config = load_config(source_dir() + file).value();
  config.swarm.members.resize(2);
  config.sim.scenario = SimScenario::kTwo;
  // Two robots render and search 400 frames a second; a sanitizer makes pixels ten times as dear.
  const int binning = kIsSanitized ? 4 : 2;
  CameraConfig& camera = config.cameras.front();
  for (int& side : camera.calibration.resolution) side /= binning;
  for (std::size_t i = 2; i < camera.calibration.intrinsics.size(); ++i)
    camera.calibration.intrinsics[i] /= binning;
  config.net.port = mesh_port;
  config.subscription.port = free_port();
  return config;
}

inline Config without_devices(int mesh_port) {
  Config config = pair_config(1, mesh_port);
  config.sim.enabled = false;
  return config;
}

/// A program on the robot.
class Client {
 public:
  explicit Client(const Config& config, const std::array<std::uint8_t, 4>& address = {127, 0, 0, 1})
      : daemon_(Endpoint::ipv4(address, static_cast<std::uint16_t>(config.subscription.port))),
        socket_(UdpSocket::bind("127.0.0.1", 0).value()) {}

  void send(const std::string& request) {
    EXPECT_TRUE(
        socket_.send_to(std::vector<std::uint8_t>(request.begin(), request.end()), daemon_));
  }

  /// The first answer of this class that is as `wanted`; `request` is repeated until it comes.
  std::optional<Json> await(const std::string& request, const std::string& wanted_class,
                            const std::function<bool(const Json&)>& wanted) {
    const Timestamp end = clock_.now() + kPatience;
    Timestamp next_request = clock_.now();
    while (clock_.now() < end) {
      if (clock_.now() >= next_request) {
        send(request);
        next_request = clock_.now() + std::chrono::milliseconds{200};
      }
      const auto datagram = socket_.receive(std::chrono::milliseconds{50});
      if (!datagram || !*datagram) continue;
      last_ = Json::parse((*datagram)->bytes);
      if (last_["class"] == wanted_class && wanted(last_)) return last_;
    }
    ADD_FAILURE() << "waited in vain; the last answer was " << last_.dump();
    return std::nullopt;
  }

  /// The next answer, if there is one within that time.
  std::optional<Json> next(std::chrono::milliseconds patience) {
    const auto datagram = socket_.receive(patience);
    if (!datagram || !*datagram) return std::nullopt;
    return Json::parse((*datagram)->bytes);
  }

  std::optional<Json> await_status(const std::function<bool(const Json&)>& wanted) {
    return await(R"({"class":"POLL"})", "STATUS", wanted);
  }

 private:
  MonotonicClock clock_;
  Endpoint daemon_;
  UdpSocket socket_;
  Json last_;
};

/// What a STATUS says of one sensor; empty while it says nothing.
inline Json sensor_of(const Json& status, const std::string& name) {
  for (const Json& sensor : status["sensors"])
    if (sensor["name"] == name) return sensor;
  return Json::object();
}

inline bool mentions(const Json& sensor, const std::string& part) {
  return !sensor.value("ok", true) && sensor.value("message", "").find(part) != std::string::npos;
}

/// How far a POSE is from the simulated truth.
struct PoseError {
  double position_m;
  double angle_rad;
};

inline PoseError error_of(const Json& message, const Config& config) {
  const MonotonicClock machine;
  const SimClock clock(machine, config.sim);
  const Timestamp stamp{Duration{std::stoll(message["t_ns"].get<std::string>())}};
  const Pose truth = SimWorld(config.sim)
                         .T_B_N(config.robot.id, RobotId{message["peer"].get<std::uint16_t>()},
                                clock.world_time_s(stamp));
  const auto number = [&](const char* part, const char* axis) {
    return message[part][axis].get<double>();
  };
  const auto p = [&](const char* axis) { return number("position", axis); };
  const auto q = [&](const char* axis) { return number("orientation", axis); };
  const Pose reported{Eigen::Vector3d(p("x"), p("y"), p("z")),
                      Eigen::Quaterniond(q("w"), q("x"), q("y"), q("z"))};
  const Vector6d d = pose_difference(truth, reported);
  return {d.head<3>().norm(), d.tail<3>().norm()};
}

class LiveDaemon : public ::testing::Test {
 protected:
  /// Half a meter and ten degrees: a pose of someone else, or at another time, is further off.
  void expect_true_poses(const Config& config) {
    Client client(config);
    const auto found = client.await(R"({"class":"WATCH"})", "POSE", [&](const Json& pose) {
      const PoseError error = error_of(pose, config);
      return pose["mode"] == "direct" && error.position_m < 0.5 && error.angle_rad < 0.17;
    });
    if (found) return;
    const auto status = client.await_status([](const Json&) { return true; });
    ADD_FAILURE() << (status ? status->dump(2) : "no STATUS either");
  }

  LogSession log_{LogLevel::kError};  // before all threads
  int mesh_port_ = free_port();
  MonotonicClock machine_;
};

}  // namespace crepes
