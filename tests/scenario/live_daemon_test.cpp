/// Whole daemons in this process, seen from outside: over their sockets and serial lines alone.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/config_file.hpp"
#include "daemon/logging.hpp"
#include "daemon/runtime.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/monotonic_clock.hpp"
#include "drivers/sim/pseudo_terminal.hpp"
#include "drivers/sim/sim_clock.hpp"
#include "drivers/sim/world.hpp"
#include "net/udp_socket.hpp"

namespace crepes {
namespace {

using Json = nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;

// What is awaited comes within a few seconds; this is for machines that do much else, sanitized.
constexpr Duration kPatience = seconds{60};

int free_port() { return UdpSocket::bind("127.0.0.1", 0)->local().port; }

/// Robot `id` of the simulated pair, alone on its subscription port.
Config pair_config(std::uint16_t id, int mesh_port) {
  const std::string file = "/config/examples/four-simulated/r" + std::to_string(id) + ".yaml";
  Config config = load_config(CREPES_SOURCE_DIR + file).value();
  config.swarm.members.resize(2);
  config.sim.scenario = SimScenario::kTwo;
  // Half the resolution: a sanitizer makes each pixel ten times as dear.
  CameraConfig& camera = config.cameras.front();
  for (int& side : camera.resolution) side /= 2;
  for (std::size_t i = 2; i < camera.intrinsics.size(); ++i) camera.intrinsics[i] /= 2.0;
  config.net.port = mesh_port;
  config.subscription.port = free_port();
  return config;
}

Config without_devices(int mesh_port) {
  Config config = pair_config(1, mesh_port);
  config.sim.enabled = false;
  return config;
}

/// A program on the robot.
class Client {
 public:
  explicit Client(const Config& config)
      : daemon_(
            Endpoint::ipv4({127, 0, 0, 1}, static_cast<std::uint16_t>(config.subscription.port))),
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
        next_request = clock_.now() + milliseconds{200};
      }
      const auto datagram = socket_.receive(milliseconds{50});
      if (!datagram || !*datagram) continue;
      last_ = Json::parse((*datagram)->bytes);
      if (last_["class"] == wanted_class && wanted(last_)) return last_;
    }
    ADD_FAILURE() << "waited in vain; the last answer was " << last_.dump();
    return std::nullopt;
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
Json sensor_of(const Json& status, const std::string& name) {
  for (const Json& sensor : status["sensors"])
    if (sensor["name"] == name) return sensor;
  return Json::object();
}

bool tells(const Json& sensor, const std::string& part) {
  return !sensor.value("ok", true) && sensor.value("message", "").find(part) != std::string::npos;
}

/// How far a POSE is from the simulated truth.
struct PoseError {
  double position_m;
  double angle_rad;
};

PoseError error_of(const Json& message, const Config& config) {
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
  const Pose told{Eigen::Vector3d(p("x"), p("y"), p("z")),
                  Eigen::Quaterniond(q("w"), q("x"), q("y"), q("z"))};
  const Vector6d d = pose_difference(truth, told);
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

TEST_F(LiveDaemon, LocatesEachOtherThoughTheirClocksDiffer) {
  const Config first = pair_config(1, mesh_port_);
  Config second = pair_config(2, mesh_port_);
  second.sim.clock_offset_s = 7.25;
  second.sim.clock_skew_ppm = 40.0;
  auto runtime_1 = std::make_unique<Runtime>(first, machine_);
  auto runtime_2 = std::make_unique<Runtime>(second, machine_);

  expect_true_poses(first);
  expect_true_poses(second);
  const SimClock clock_1(machine_, first.sim);
  const SimClock clock_2(machine_, second.sim);
  EXPECT_TRUE(Client(first).await_status([&](const Json& status) {
    if (status["clocks"].empty()) return false;
    const double offset_s = to_seconds(clock_2.now() - clock_1.now());
    return std::abs(status["clocks"][0]["offset_s"].get<double>() - offset_s) < 1e-3;
  }));

  const Timestamp asked = machine_.now();
  runtime_1.reset();
  runtime_2.reset();
  EXPECT_LT(machine_.now() - asked, seconds{2});  // one each
}

TEST_F(LiveDaemon, OpensASerialDeviceThatComesGoesAndComesAgain) {
  const std::filesystem::path port =
      std::filesystem::path(::testing::TempDir()) / ("crepes-imu-" + std::to_string(mesh_port_));
  Config config = without_devices(mesh_port_);
  config.imu.port = port;
  const Runtime runtime(config, machine_);
  Client client(config);
  auto sample = [turn = 0]() mutable {  // what repeats itself is taken for stuck
    return encode_witmotion({0.01 * (++turn % 100), 0.2, 0.3}, {0.0, 0.0, 9.81});
  };
  const auto missing = [](const Json& status) {
    return tells(sensor_of(status, "imu"), "crepes-imu-");
  };

  EXPECT_TRUE(client.await_status(missing));
  for (int time = 0; time < 2; ++time) {
    PseudoTerminal device = PseudoTerminal::open().value();
    std::filesystem::create_symlink(device.path(), port);
    EXPECT_TRUE(client.await_status([&](const Json& status) {
      device.write(sample());
      const Json imu = sensor_of(status, "imu");
      return imu.value("ok", false) && imu.value("rate_hz", 0.0) > 0.0;
    }));
    std::filesystem::remove(port);
    device = PseudoTerminal::open().value();  // hangs up on the reader
    EXPECT_TRUE(client.await_status(missing));
  }
}

TEST_F(LiveDaemon, TellsThatTheMeshInterfaceIsNotThereAndGoesOn) {
  Config config = pair_config(1, mesh_port_);
  config.net.interface = "nosuch0";
  const Runtime runtime(config, machine_);

  EXPECT_TRUE(Client(config).await_status([](const Json& status) {
    return tells(sensor_of(status, "mesh"), "nosuch0") &&
           sensor_of(status, "imu").value("ok", false) &&
           status["neighbors"][0]["reason"] == "never heard";
  }));
}

TEST_F(LiveDaemon, CountsForeignDatagramsAndAnswersFoolishRequests) {
  const Config config = without_devices(mesh_port_);
  const Runtime runtime(config, machine_);
  Client client(config);
  UdpSocket stranger =
      UdpSocket::open_broadcast("lo", static_cast<std::uint16_t>(mesh_port_)).value();
  const std::vector<std::uint8_t> noise(200, 0x5a);

  EXPECT_TRUE(client.await("\xff{not json", "ERROR", [](const Json& error) {
    return !error["message"].get<std::string>().empty();
  }));
  EXPECT_TRUE(client.await_status([&](const Json& status) {
    EXPECT_TRUE(stranger.broadcast(noise));
    return status["network"].value("refused_foreign", 0) > 0 &&
           status["network"].value("requests_refused", 0) > 0;
  }));
}

}  // namespace
}  // namespace crepes
