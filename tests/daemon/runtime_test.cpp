#include "daemon/runtime.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "daemon/config_file.hpp"
#include "daemon/logging.hpp"
#include "drivers/monotonic_clock.hpp"
#include "net/udp_socket.hpp"
#include "tests/support/places.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A port that nobody uses, so that tests may run side by side.
int free_port() {
  const Result<UdpSocket> probe = UdpSocket::bind("127.0.0.1", 0);
  EXPECT_TRUE(probe.has_value());
  return probe->local().port;
}

/// One of two simulated robots that hear each other on `mesh_port`.
Config robot_config(std::uint16_t id, int mesh_port) {
  Result<Config> loaded = load_config(source_dir() + "/config/examples/four-simulated/r" +
                                      std::to_string(id) + ".yaml");
  EXPECT_TRUE(loaded.has_value());
  Config config = *loaded;
  config.net.port = mesh_port;
  config.subscription.port = free_port();
  config.sim.scenario = SimScenario::kTwo;
  config.swarm.members.resize(2);
  // A quarter of the pixels at a quarter of the rate, for a sanitizer's pace on a laden machine;
  // slots as much longer.
  CameraConfig& camera = config.cameras.at(0);
  for (int i = 2; i < 6; ++i) camera.intrinsics.at(static_cast<std::size_t>(i)) /= 2;
  camera.resolution = {640, 512};
  camera.rate_hz = 50;
  config.swarm.slot_ms = 40;
  return config;
}

/// A program on the robot that asks for poses.
class Client {
 public:
  explicit Client(int port)
      : server_(Endpoint::ipv4({127, 0, 0, 1}, static_cast<std::uint16_t>(port))),
        socket_(UdpSocket::bind("127.0.0.1", 0)) {}

  void send(const std::string& request) {
    EXPECT_TRUE(
        socket_->send_to(std::vector<std::uint8_t>(request.begin(), request.end()), server_));
  }

  /// What it is told within `time`.
  std::vector<std::string> hear(Duration time) {
    const MonotonicClock clock;
    const Timestamp end = clock.now() + time;
    std::vector<std::string> told;
    while (clock.now() < end) {
      const auto datagram = socket_->receive(milliseconds{50});
      if (datagram && *datagram)
        told.emplace_back((*datagram)->bytes.begin(), (*datagram)->bytes.end());
    }
    return told;
  }

 private:
  Endpoint server_;
  Result<UdpSocket> socket_;
};

bool is_of(const std::string& message, const std::string& what) {
  return message.find("\"class\":\"" + what + '"') != std::string::npos;
}

TEST(Runtime, TwoSimulatedRobotsGiveEachOthersPosesToSubscribers) {
  const LogSession log(LogLevel::kError);
  const MonotonicClock machine;
  const int mesh_port = free_port();
  const Config config = robot_config(1, mesh_port);
  const Runtime first(config, machine);
  const Runtime second(robot_config(2, mesh_port), machine);
  Client client(config.subscription.port);

  bool version = false;
  bool pose = false;
  std::string status;  // tells why there is no pose
  const Timestamp give_up = machine.now() + seconds{40};
  while (!(version && pose) && machine.now() < give_up) {
    // What is sent before the daemon's socket is open is lost.
    client.send(R"({"class":"WATCH","enable":true})");
    client.send(R"({"class":"POLL"})");
    for (const std::string& said : client.hear(milliseconds{500})) {
      version = version || is_of(said, "VERSION");
      pose = pose || (is_of(said, "POSE") && said.find(R"("peer":2)") != std::string::npos);
      if (is_of(said, "STATUS")) status = said;
    }
  }

  EXPECT_TRUE(version);
  EXPECT_TRUE(pose) << status;
}

TEST(Runtime, TellsWhatIsWrongWithDevicesThatAreNotThere) {
  const LogSession log(LogLevel::kError);
  const MonotonicClock machine;
  Config config = robot_config(1, free_port());
  config.sim.enabled = false;
  config.uwb.port = "/dev/nothing-here";
  const Runtime runtime(config, machine);
  Client client(config.subscription.port);

  std::string status;
  const auto tells = [&](const char* what) { return status.find(what) != std::string::npos; };
  const Timestamp give_up = machine.now() + seconds{10};
  while (machine.now() < give_up && !(tells("/dev/nothing-here") && tells("set imu.port"))) {
    client.send(R"({"class":"POLL"})");
    for (const std::string& said : client.hear(milliseconds{100}))
      if (is_of(said, "STATUS")) status = said;
  }

  EXPECT_TRUE(tells("/dev/nothing-here")) << status;
  EXPECT_TRUE(tells("set imu.port")) << status;
}

TEST(Runtime, StopsWithinASecondAndAllLoopsTurnUntilThen) {
  const LogSession log(LogLevel::kError);
  const MonotonicClock machine;
  Timestamp asked;
  {
    const Runtime runtime(robot_config(2, free_port()), machine);
    Watchdog watchdog(runtime.heartbeats());
    std::vector<std::string> stuck{"not yet looked"};
    // A look is honest when there was time to turn; a laden machine may need more than one.
    for (int i = 0; i < 10 && !stuck.empty(); ++i) {
      wait_for(milliseconds{500}, std::stop_token{});
      stuck = watchdog.check();
    }
    EXPECT_TRUE(stuck.empty()) << stuck.front();
    asked = machine.now();
  }

  EXPECT_LT(machine.now() - asked, seconds{1});
}

TEST(Watchdog, NamesTheLoopThatMadeNoProgress) {
  Counter living;
  Counter dead;
  Watchdog watchdog({{"living", &living}, {"dead", &dead}});
  living.add();
  dead.add();
  EXPECT_TRUE(watchdog.check().empty());

  living.add();

  EXPECT_EQ(watchdog.check(), std::vector<std::string>{"dead"});
}

}  // namespace
}  // namespace crepes
