#include "daemon/runtime.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "daemon/config_file.hpp"
#include "drivers/monotonic_clock.hpp"
#include "net/udp_socket.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// One of two simulated robots, on ports that no real swarm uses.
Config robot_config(std::uint16_t id) {
  Result<Config> loaded =
      load_config(std::string(CREPES_SOURCE_DIR) + "/config/examples/four-simulated/r" +
                  std::to_string(id) + ".yaml");
  EXPECT_TRUE(loaded.has_value());
  Config config = *loaded;
  config.net.port = 47374;
  config.subscription.port = 47374 + id;
  config.sim.scenario = SimScenario::kTwo;
  config.swarm.members.resize(2);
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

  /// The next datagram that holds `part`, if it comes within `timeout`.
  std::optional<std::string> await(const std::string& part, Duration timeout) {
    const MonotonicClock clock;
    const Timestamp end = clock.now() + timeout;
    while (clock.now() < end) {
      const auto datagram = socket_->receive(milliseconds{50});
      if (!datagram || !*datagram) continue;
      std::string text((*datagram)->bytes.begin(), (*datagram)->bytes.end());
      if (text.find(part) != std::string::npos) return text;
    }
    return std::nullopt;
  }

 private:
  Endpoint server_;
  Result<UdpSocket> socket_;
};

TEST(Runtime, TwoSimulatedRobotsGiveEachOthersPosesToSubscribers) {
  const MonotonicClock machine;
  const Runtime first(robot_config(1), machine);
  const Runtime second(robot_config(2), machine);
  Client client(47375);

  client.send(R"({"class":"WATCH","enable":true})");

  EXPECT_TRUE(client.await(R"("class":"VERSION")", seconds{5}));
  EXPECT_TRUE(client.await(R"("peer":2)", seconds{20}));
}

TEST(Runtime, TellsWhatIsWrongWithDevicesThatAreNotThere) {
  const MonotonicClock machine;
  Config config = robot_config(1);
  config.sim.enabled = false;
  config.uwb.port = "/dev/nothing-here";
  const Runtime runtime(config, machine);
  Client client(47375);

  std::optional<std::string> status;
  for (int i = 0; i < 50 && (!status || status->find("nothing-here") == std::string::npos); ++i) {
    client.send(R"({"class":"POLL"})");
    status = client.await(R"("class":"STATUS")", milliseconds{100});
  }

  ASSERT_TRUE(status);
  EXPECT_NE(status->find("/dev/nothing-here"), std::string::npos) << *status;
  EXPECT_NE(status->find("set imu.port"), std::string::npos) << *status;
}

TEST(Runtime, StopsWithinASecondAndAllLoopsTurnUntilThen) {
  const MonotonicClock machine;
  Timestamp asked;
  {
    const Runtime runtime(robot_config(2), machine);
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
